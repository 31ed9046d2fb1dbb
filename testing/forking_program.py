# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Forks processes as a node does, does with them what its argument says, and prints what it saw."""

from __future__ import annotations

import os
import signal
import sys
import time
from contextlib import suppress

from focus_planner.runtime.fork_server import ForkServerEnded, fork_server


def prepare():
    if sys.argv[1] == "cannot_import":
        raise ImportError("libmissing.so: failed\nto map")

    def work(connection):
        with suppress(EOFError):
            while True:
                carry_out(connection, connection.recv())

    return work


def carry_out(connection, order):
    if order == "exit":
        os._exit(3)
    if order == "abort":
        os.kill(os.getpid(), signal.SIGSEGV)
    if order == "spin":
        connection.send("spinning")
        until = time.process_time() + 0.3
        while time.process_time() < until:
            pass
    connection.send((order, os.getpid()))


def answers(server):
    first, second = server.fork(), server.fork()
    for process in (first, second):
        process.connection.send("hello")
    return [p.connection.recv() == ("hello", p.pid) for p in (first, second)]


def ends(server):
    told = []
    for order in ("exit", "abort"):
        process = server.fork()
        process.connection.send(order)
        told += [process.wait(60), process.how_it_ended()]
        process.kill()
    return told


def kills(server):
    process = server.fork()
    process.connection.send("spin")
    process.connection.recv()
    process.kill()
    return [process.how_it_ended(), process.wait(0.0), process.cpu_seconds()]


def counts(server):
    process = server.fork()
    before = process.cpu_seconds()
    process.connection.send("spin")
    process.connection.recv()
    process.connection.recv()
    return process.cpu_seconds() - before >= 0.2


def signals(server):
    process = server.fork()
    process.connection.send("hello")
    process.connection.recv()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        os.kill(process.pid, number)
    process.connection.send("still there")
    return process.connection.recv()[0]


def loses_its_server(server):
    server._channel.shutdown(2)
    try:
        server.fork()
    except ForkServerEnded:
        return "told"
    return "not told"


def cannot_import(server):
    try:
        server.fork()
    except ForkServerEnded as error:
        return str(error)
    return "not told"


def waits_to_be_killed(server):
    process = server.fork()
    process.connection.send("hello")
    process.connection.recv()
    print(process.pid, flush=True)
    time.sleep(600)


if __name__ == "__main__":
    with fork_server("of the tests", prepare) as forking:
        print(globals()[sys.argv[1]](forking))
