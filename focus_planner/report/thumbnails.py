# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What each camera will see, for a report; this needs the extra ``picture``."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from focus_planner.core.planning.plan import FocusPlan
from focus_planner.core.planning.subject import PlannedSubject
from focus_planner.core.rig.rig import Rig
from focus_planner.preview.pictures import note_on_circles, thumbnails
from focus_planner.report.pictures import Pictures


def camera_pictures(
    rig: Rig,
    on_progress: Callable[[str], Callable[[float], object]] = lambda _: lambda _: None,
) -> Pictures:
    """Return the pictures of a rig's cameras, which are made when a report asks for them.

    Parameters
    ----------
    rig : Rig
    on_progress : callable, optional
        Returns, for a plan's method, what is called with the share of its pictures that is done.
    """

    def make(subject: PlannedSubject, plan: FocusPlan, longest_side: int) -> Iterable[bytes]:
        return thumbnails(subject, plan, longest_side, on_progress(plan.method))

    return Pictures(make, note_on_circles(rig))
