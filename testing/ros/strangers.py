# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Two nodes that may meet; run by test_strangers.py, in a network of its own."""

from __future__ import annotations

import fcntl
import json
import socket
import struct
import sys
import time
from contextlib import suppress
from pathlib import Path

from rclpy.context import Context
from rclpy.node import Node
from std_msgs.msg import String

SIOCSIFFLAGS, IFF_UP = 0x8914, 1


def bring_up_loopback():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        fcntl.ioctl(any_socket, SIOCSIFFLAGS, struct.pack("16sh", b"lo", IFF_UP))


def address(text):
    """Return host and port of what /proc writes as hexadecimal numbers."""
    host, port = text.split(":")
    return ".".join(str(byte) for byte in bytes.fromhex(host)[::-1]), int(port, 16)


def sockets():
    """Return addresses of this process's UDP sockets."""
    links = set()
    for each in Path("/proc/self/fd").iterdir():
        with suppress(OSError):  # that of the folder itself is gone
            links.add(str(each.readlink()))
    rows = [line.split() for line in Path("/proc/self/net/udp").read_text().splitlines()[1:]]
    return [address(row[1]) for row in rows if f"socket:[{row[9]}]" in links]


def groups():
    """Return the multicast groups that this network has joined."""
    rows = [line.split() for line in Path("/proc/self/net/igmp").read_text().splitlines()[1:]]
    return [address(f"{row[0]}:0")[0] for row in rows if len(row) == 4]


def packets():
    """Return the number of packets that were sent."""
    rows = [line.split() for line in Path("/proc/self/net/dev").read_text().splitlines()]
    return {row[0]: int(row[10]) for row in rows if row[0].endswith(":")}


def shared():
    """Return the files of Fast DDS that this process shares with others of this machine."""
    maps = Path("/proc/self/maps").read_text().splitlines()
    return sorted({line.split()[-1] for line in maps if "/dev/shm/fastrtps" in line})


def main(patience):
    """Wait for the two to meet, at most so many seconds, and print what was seen."""
    bring_up_loopback()
    nodes = []
    for name in ("one", "two"):
        context = Context()
        context.init(args=[])
        nodes.append(Node(name, context=context, use_global_arguments=False))
    publisher = nodes[0].create_publisher(String, "greetings", 1)
    nodes[1].create_subscription(String, "greetings", lambda _: None, 1)
    until = time.monotonic() + patience
    while not publisher.get_subscription_count() and time.monotonic() < until:
        time.sleep(0.05)
    seen = {"sockets": sockets(), "groups": groups(), "packets": packets(), "shared": shared()}
    seen["met"] = publisher.get_subscription_count() == 1
    sys.stdout.write(json.dumps(seen))
    for node in nodes:
        node.destroy_node()
        node.context.try_shutdown()


if __name__ == "__main__":
    main(float(sys.argv[1]))
