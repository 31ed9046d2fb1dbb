# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A logger that keeps what it is given."""

from __future__ import annotations


class RecordingLogger:
    """Stands in for rclpy's logger."""

    def __init__(self):
        self.records = []

    def _log(self, level, message):
        self.records.append((level, message))

    def get_child(self, _):
        return self

    def debug(self, message, **_):
        self._log("debug", message)

    def info(self, message, **_):
        self._log("info", message)

    def warning(self, message, **_):
        self._log("warning", message)

    def error(self, message, **_):
        self._log("error", message)

    def of(self, level):
        return [message for kind, message in self.records if kind == level]


def recorded_log(node):
    """Have a node log to a recorder, and return that."""
    logger = RecordingLogger()
    node.get_logger = lambda: logger
    return logger
