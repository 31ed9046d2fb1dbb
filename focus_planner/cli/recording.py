# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Recording the runs of a command."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from focus_planner.cli.option_rules import check_beside
from focus_planner.cli.terminal import show_error

if TYPE_CHECKING:
    from focus_planner.core.planning.plan import SolvedPlan
    from focus_planner.core.progress import ProgressCallback
    from focus_planner.core.rig.rig import Rig
    from focus_planner.recording.bag import BagMessage
    from focus_planner.recording.run import Beginning

#: The node's default name, under which commands record their runs.
PLANNER = "/focus_planner"
#: Exit status if all was done but the recording.
NOT_RECORDED = 1
_ACCESSES = ("owner", "group", "all")


class End(Protocol):
    """Ends the recording of a run."""

    def __call__(
        self,
        success: bool,
        message: str,
        plan: SolvedPlan | None = None,
        rig: Rig | None = None,
        /,
    ) -> Path | None:
        """Write the end of the run; return its folder once it is written, None if it is not."""


def add_recording_options(parser: Any, runs: str, plans: str) -> None:
    """Add the options of a command that can record its runs.

    Parameters
    ----------
    parser : argparse parser or group
    runs, plans : str
        What it records, and what is in that.
    """
    option = parser.add_argument
    option(
        "--record", type=Path, metavar="DIR", help=f"record {runs} below this folder, for replay"
    )
    option(
        "--markers",
        action="store_true",
        default=None,
        help=f"with --record: include what shows {plans} in 3D",
    )
    option(
        "--record-access",
        choices=_ACCESSES,
        help="with --record: who may read what is recorded, whatever the umask (default:"
        f" {_ACCESSES[0]})",
    )


def recorder_of(options: argparse.Namespace) -> CommandRecorder:
    """Return what records as the options ask.

    Raises
    ------
    InputError
        If the options say how to record, but not to record.
    """
    for option in ("--markers", "--record-access"):
        check_beside(options, option, "--record")
    access = options.record_access or _ACCESSES[0]
    return CommandRecorder(options.record, bool(options.markers), access)


class CommandRecorder:
    """Records one run after another; a failure is reported, and does not stop the planning.

    Parameters
    ----------
    directory : Path or None
        None to record nothing.
    markers : bool
    access : {"owner", "group", "all"}
        Who may read the runs.

    Attributes
    ----------
    failed : bool
        Whether a run was not recorded.
    """

    def __init__(
        self, directory: Path | None, markers: bool = False, access: str = "owner"
    ) -> None:
        self.failed = False
        self._directory = directory
        self._markers = markers
        self._access = access

    def begin(
        self,
        what: Callable[[], tuple[Sequence[BagMessage], Beginning]],
        on_progress: ProgressCallback,
    ) -> tuple[ProgressCallback, End]:
        """Begin to record a run; return the callback to plan with, and the one that ends it."""
        if self._directory is None:
            return on_progress, _no_end
        from focus_planner.parameters.planner_settings import Recording
        from focus_planner.recording.recorder import Recorder
        from focus_planner.runtime.log import SilentLog

        try:
            inputs, beginning = what()
        except Exception as error:  # noqa: BLE001 - no message has room for a seed of 2^64
            self._fail(str(error) or repr(error))
            return on_progress, _no_end
        recorder = Recorder(SilentLog())  # a failure is reported once, at the end
        options = Recording(self._directory, self._markers, access=self._access)
        record = recorder.begin(options, inputs, beginning)
        # A node that starts puts the last plan that was published in force again: not this one.
        record.publishes = False

        def end(
            success: bool,
            message: str,
            plan: SolvedPlan | None = None,
            rig: Rig | None = None,
            /,
        ) -> Path | None:
            record.finish(success, message, plan, rig)
            recorder.close()
            if record.failure:
                self._fail(record.failure)
            return record.path

        return record.wrap_callback(on_progress), end

    def _fail(self, why: str) -> None:
        self.failed = True
        show_error(f"not recorded: {why}")


def _no_end(*_: object) -> None:
    """End a run that is not recorded."""
