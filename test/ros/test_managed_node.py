# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Transitions of a managed node, in this process."""

from __future__ import annotations

import threading

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState

from focus_planner.core.validation import InputError
from focus_planner.ros.lifecycle import ManagedNode
from testing.ros.log import recorded_log


class Machine(ManagedNode):
    """Notes its steps; one of them may raise or be interrupted."""

    def __init__(self, context):
        super().__init__("here", context=context, use_global_arguments=False)
        self.steps = []
        self.raises = {}
        self.completes = True

    def _step(self, name):
        self.steps.append(name)
        if name in self.raises:
            raise self.raises[name]

    def configure(self):
        self._step("configure")
        return self.completes

    def activate(self):
        self._step("activate")

    def deactivate(self):
        self._step("deactivate")

    def clean_up(self):
        self._step("clean_up")


@pytest.fixture
def node(context):
    node = Machine(context)
    yield node
    node.destroy_node()


@pytest.fixture
def log(node):
    return recorded_log(node)


def ask(node, **transition):
    """Make the request as a client does; return whether the transition was made."""
    request = ChangeState.Request(transition=Transition(**transition))
    return node._service_change_state.callback(request, ChangeState.Response()).success


def test_it_starts_up_and_shuts_down(node, log):
    assert node.state == "unconfigured"
    node.start_up()
    assert (node.state, node.steps) == ("active", ["configure", "activate"])
    assert not node.is_finalized
    node.shut_down()
    assert (node.state, node.steps[2:]) == ("finalized", ["deactivate"])
    assert node.is_finalized
    node.shut_down()
    assert node.steps[2:] == ["deactivate"]
    assert log.records == []


def test_every_transition_takes_its_step(node):
    for label in ("configure", "activate", "deactivate", "cleanup", "configure", "shutdown"):
        assert ask(node, label=label)
    steps = ["configure", "activate", "deactivate", "clean_up", "configure", "deactivate"]
    assert node.steps == steps


def test_it_does_not_start_up_what_somebody_else_has_configured(node):
    assert ask(node, label="configure")
    node.start_up()
    assert (node.state, node.steps) == ("inactive", ["configure"])


def test_what_is_not_configured_is_not_activated(node, log):
    node.completes = False
    node.start_up()
    assert (node.state, node.steps) == ("unconfigured", ["configure"])
    assert log.records == []
    node.completes = True
    node.start_up()
    assert node.state == "active"


@pytest.mark.parametrize(
    "error", [InputError("qos", "a good one", "a bad one"), OSError("the disk is full")]
)
def test_an_expected_error_is_logged_and_the_transition_fails(node, log, error):
    node.raises = {"configure": error}
    assert not ask(node, label="configure")
    assert (node.state, node.steps) == ("unconfigured", ["configure"])
    assert log.records == [("error", str(error))]
    node.raises = {}
    assert ask(node, label="configure")


def test_after_an_unexpected_error_it_cleans_up(node, log):
    node.raises = {"configure": ZeroDivisionError("a bug")}
    assert not ask(node, label="configure")
    assert (node.state, node.steps) == ("unconfigured", ["configure", "clean_up"])
    (first, *_, last) = log.records
    assert first == ("error", "| Traceback (most recent call last):")
    assert last == ("error", "| ZeroDivisionError: a bug")


@pytest.mark.parametrize(
    ("transition", "name"),
    [({"label": "activate"}, "activate"), ({"id": 3}, "number 3"), ({"id": 99}, "number 99")],
)
def test_an_impossible_transition_is_refused(node, log, transition, name):
    assert not ask(node, **transition)
    assert (node.state, node.steps) == ("unconfigured", [])
    text = f"refused the transition {name}: not possible in state unconfigured"
    if "id" in transition:
        assert log.records == [("warning", text)]
    assert ask(node, label="configure")


def test_one_transition_is_made_at_a_time(node, log):
    begun, done, answers = threading.Event(), threading.Event(), []

    def configure():
        begun.set()
        return done.wait(240)

    node.configure = configure
    other = threading.Thread(target=lambda: answers.append(ask(node, label="configure")))
    other.start()
    assert begun.wait(240)
    assert not ask(node, label="configure")
    assert log.records == [("warning", "refused a transition: another one is in progress")]
    done.set()
    other.join()
    assert answers == [True]
    assert node.state == "inactive"
