# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Mistakes in a surface or a rig that would explain why the rig sees little.

Each is tried on some samples: if the rig would see far more without it, it is suspected.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import wraps
from typing import NamedTuple, TypeVar
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.rig.camera import Camera
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Samples
from focus_planner.core.surface.visibility import Visibility, seen_by_any, visible_pairs

_TRIAL_SAMPLES = 300
_TRIAL_CAMERAS = 64
_BLIND_SAMPLES = 4096
# What is suspected must bring at least so much into view, and so many times what is seen now.
_SEEN_ENOUGH = 0.2
_FAR_BETTER = 2.0
# It must also bring more of the surface into view: cameras that see nothing of a subject that is
# small or flat are no mistake.
_MORE = 1.1


Found = TypeVar("Found")


@dataclass(frozen=True)
class Sight:
    """How much a rig sees.

    Attributes
    ----------
    surface : float
        The share of the surface, by importance, that some camera sees.
    cameras : float
        The share of the cameras that see something.
    """

    surface: float
    cameras: float

    @property
    def score(self) -> float:
        """Both at once: a mistake may cost either."""
        return self.surface * self.cameras

    def __str__(self) -> str:
        return f"{self.surface:.0%} of the surface by {self.cameras:.0%} of the cameras"


class Suspicion(NamedTuple):
    """A mistake that explains what is seen.

    Attributes
    ----------
    code : str
        As in :class:`~focus_planner.core.notes.Note`.
    assumption : str
        What would bring more into view, as a clause after "with".
    sight, now : Sight
        With the assumption, and without.
    meaning : str
        What is probably wrong, and what to do.
    """

    code: str
    assumption: str
    sight: Sight
    now: Sight
    meaning: str

    def __str__(self) -> str:
        return f"with {self.assumption}, {self.sight} would be seen, now {self.now}: {self.meaning}"


def _remembered(find: Callable[[Scene, Rig], Found]) -> Callable[[Scene, Rig], Found]:
    """Keep what is found for each scene: every plan for it asks."""
    known: WeakKeyDictionary[Scene, tuple[Rig, Found]] = WeakKeyDictionary()

    @wraps(find)
    def remembered(scene: Scene, rig: Rig) -> Found:
        if scene not in known or known[scene][0] is not rig:
            known[scene] = rig, find(scene, rig)
        return known[scene][1]

    return remembered


@_remembered
def suspect_frames(scene: Scene, rig: Rig) -> Suspicion | None:
    """Return the mistake without which the rig would see most, if that is far more than now.

    Parameters
    ----------
    scene : Scene
    rig : Rig
    """
    # Loads SciPy, and most rigs see what they should.
    from focus_planner.core.planning.pose_trials import posed, poses_of, trials  # noqa: PLC0415

    few = _few(rig)
    poses = poses_of(few)
    samples = scene.sample(_TRIAL_SAMPLES, 0)
    now = _sight(scene, few, samples)
    best, least = None, max(_SEEN_ENOUGH, _FAR_BETTER * now.score)
    for trial in trials():
        sight = _sight(scene, posed(few, trial.correct(poses)), samples)
        if sight.score > least and sight.surface > _MORE * now.surface:
            best = Suspicion(trial.code, trial.assumption, sight, now, trial.meaning)
            least = sight.score
    return best


@_remembered
def blind_cameras(scene: Scene, rig: Rig) -> NDArray[np.bool_]:
    """Return (C,) whether each camera sees nothing of the surface, whatever its importance."""
    samples = scene.sample(_BLIND_SAMPLES, 0, by="area")
    blind: NDArray[np.bool_] = np.diff(visible_pairs(scene, rig, samples).camera_offsets) == 0
    return blind


@_remembered
def seen_from_behind(scene: Scene, rig: Rig) -> float:
    """Return the share of the surface that cameras see from behind, and none from the front."""
    samples = scene.sample(_TRIAL_SAMPLES, 0)
    unseen = samples.take(np.flatnonzero(~seen_by_any(scene, rig, samples)))
    if not len(unseen):
        return 0.0
    turned = replace(unseen, normals=-unseen.normals)
    behind = seen_by_any(scene, rig, turned)
    return float(unseen.weights[behind].sum() / samples.weights.sum())


def sight(scene: Scene, rig: Rig) -> Sight:
    """Return how much a rig sees of a surface, roughly: some of its cameras, of some samples."""
    return _sight(scene, _few(rig), scene.sample(_TRIAL_SAMPLES, 0))


def _few(rig: Rig) -> tuple[Camera, ...]:
    return rig.cameras[:: math.ceil(len(rig) / _TRIAL_CAMERAS)]


def _sight(scene: Scene, cameras: Iterable[Camera], samples: Samples) -> Sight:
    visibility = visible_pairs(scene, Rig(tuple(cameras)), samples)
    seen = float(samples.weights[_seen(samples, visibility)].sum() / samples.weights.sum())
    return Sight(seen, float((np.diff(visibility.camera_offsets) > 0).mean()))


def _seen(samples: Samples, visibility: Visibility) -> NDArray[np.bool_]:
    seen = np.zeros(len(samples), dtype=np.bool_)
    seen[visibility.sample_index] = True
    return seen
