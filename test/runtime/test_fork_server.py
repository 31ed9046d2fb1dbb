# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Processes that are forked on request, from a program that does nothing else."""

from __future__ import annotations

import os
import select
from ast import literal_eval

import pytest

from testing.forked import PIPE, ForkedProcess, run_forked

pytestmark = pytest.mark.processes


def run(what):
    ended = run_forked("testing.forking_program", what)
    assert (ended.returncode, ended.stderr) == (0, "")
    return literal_eval(ended.stdout) if ended.stdout[0] in "[TF" else ended.stdout.strip()


def test_every_process_has_a_connection_of_its_own():
    assert run("answers") == [True, True]


def test_it_is_told_how_a_process_ended():
    assert run("ends") == [True, "it ended with status 3", True, "it was ended by SIGSEGV"]


def test_a_process_is_killed_whatever_it_is_doing():
    assert run("kills") == [
        "it was ended by SIGKILL, as Linux does when memory runs out",
        True,
        0.0,
    ]


def test_the_time_on_processors_is_told():
    assert run("counts") is True


def test_a_signal_to_all_leaves_processes_to_their_program():
    assert run("signals") == "still there"


def test_a_server_that_has_gone_is_told():
    assert run("loses_its_server") == "told"


def test_a_server_that_cannot_import_says_why_and_leaves_no_traceback():
    assert run("cannot_import") == "ImportError: libmissing.so: failed to map"


def test_processes_end_with_their_program_even_if_that_is_killed():
    program = ForkedProcess("testing.forking_program", "waits_to_be_killed", stdout=PIPE)
    with program.stdout:
        pid = int(program.stdout.readline())
    handle = os.pidfd_open(pid)
    assert not select.select([handle], [], [], 0.0)[0]
    program.kill()
    program.wait()
    assert select.select([handle], [], [], 240)[0]
    os.close(handle)
