# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What keeps strangers out without keys: a domain, and staying on this machine.

What is observed is observed in a network of its own, where loopback is the only interface, so that
nothing can leave whatever happens.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from rclpy.context import Context
from rclpy.node import Node
from std_msgs.msg import String

from testing.domains import claim_domain
from testing.ros.calls import until
from testing.ros.planner_process import PATIENCE

ROOT = Path(__file__).parents[2]
STRANGERS = ROOT / "testing" / "ros" / "strangers.py"
PROFILE = ROOT / "security" / "loopback.xml"
WITHOUT_SHARED_MEMORY = ROOT / "security" / "loopback_udp.xml"
DOMAIN = 33
# The port numbers of RTPS 2.2, 9.6.1: those of a domain, and of its multicast discovery.
PORTS = range(7400 + 250 * DOMAIN, 7400 + 250 * (DOMAIN + 1))
DISCOVERY = "239.255.0.1"
OWN_NETWORK = ["unshare", "--map-root-user", "--net"]


def can_have_a_network():
    try:
        return (
            subprocess.run([*OWN_NETWORK, "true"], capture_output=True, check=False).returncode == 0
        )
    except OSError:
        return False


@pytest.fixture
def own_network():
    if not can_have_a_network():
        pytest.skip("this machine lets nobody make a network namespace")


def seen(discovery_range, patience=PATIENCE, **environment):
    """Run two nodes in a network of their own, and return what was seen."""
    environment = {
        **os.environ,
        "ROS_DOMAIN_ID": str(DOMAIN),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": discovery_range,
        **environment,
    }
    command = [*OWN_NETWORK, sys.executable, str(STRANGERS), str(patience)]
    process = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert process.returncode == 0, process.stderr
    return json.loads(process.stdout)


def listening(found):
    """Return the addresses at which the ports of the domain are bound."""
    return {host for host, port in found["sockets"] if port in PORTS}


@pytest.mark.processes
@pytest.mark.usefixtures("own_network")
def test_on_a_subnet_discovery_is_by_multicast():
    found = seen("SUBNET")
    assert found["met"]
    assert DISCOVERY in found["groups"]


@pytest.mark.processes
@pytest.mark.usefixtures("own_network")
def test_with_localhost_nodes_meet_without_multicast():
    found = seen("LOCALHOST")
    assert found["met"]
    assert found["groups"] == ["224.0.0.1"]  # which every interface is in
    assert found["packets"]["lo:"] > 0
    # It is documented that a firewall, or the profile below, has to close these.
    assert listening(found) == {"0.0.0.0"}


@pytest.mark.processes
@pytest.mark.usefixtures("own_network")
def test_with_the_loopback_profile_nodes_listen_on_loopback_only():
    found = seen("LOCALHOST", FASTRTPS_DEFAULT_PROFILES_FILE=str(PROFILE))
    assert found["met"]
    assert found["groups"] == ["224.0.0.1"]
    assert listening(found) == {"127.0.0.1"}
    assert found["shared"]


@pytest.mark.processes
@pytest.mark.usefixtures("own_network")
def test_with_the_profile_of_udp_they_share_no_memory_either():
    found = seen("SUBNET", FASTRTPS_DEFAULT_PROFILES_FILE=str(WITHOUT_SHARED_MEMORY))
    assert found["met"]
    assert listening(found) == {"127.0.0.1", DISCOVERY}
    assert not found["shared"]


@pytest.mark.processes
@pytest.mark.usefixtures("own_network")
def test_with_discovery_off_nodes_do_not_meet_and_send_nothing():
    found = seen("OFF", patience=2.0)
    assert not found["met"]
    assert found["groups"] == ["224.0.0.1"]
    assert found["packets"]["lo:"] == 0


def test_nodes_of_different_domains_do_not_meet():
    domain = claim_domain()
    domains = (domain, domain, claim_domain())
    contexts = [Context() for _ in domains]
    try:
        for context, domain in zip(contexts, domains, strict=True):
            context.init(args=[], domain_id=domain)
        speaker, listener, stranger = (
            Node(name, context=context, use_global_arguments=False)
            for name, context in zip(("speaker", "listener", "stranger"), contexts, strict=True)
        )
        elsewhere = stranger.create_publisher(String, "greetings", 1)
        publisher = speaker.create_publisher(String, "greetings", 1)
        listener.create_subscription(String, "greetings", lambda _: None, 1)
        until(publisher.get_subscription_count)
        # The others have met, so that there was time for the stranger; and a second more.
        time.sleep(1.0)
        assert elsewhere.get_subscription_count() == 0
        assert set(stranger.get_node_names()) == {"stranger"}
        until(lambda: set(listener.get_node_names()) == {"speaker", "listener"})
    finally:
        for context in contexts:
            context.try_shutdown()
