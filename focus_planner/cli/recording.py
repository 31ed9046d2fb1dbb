"""Recording the runs of a command."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

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
