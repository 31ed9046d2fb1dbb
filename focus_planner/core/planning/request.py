# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What to plan with: the method, its sampling, its limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from focus_planner.core.planning.field_spec import (
    FieldSpec,
    documented,
    specified,
    specified_fields,
)
from focus_planner.core.rig.rig import MAX_CAMERAS
from focus_planner.core.validation import MAX_COORDINATE

#: Those of the solvers.
METHODS = ("closest", "average", "em", "greedy", "k_view", "optimal")

SCOPES = ("all", "assigned")

TUPLES = ("overlap", "grid")

BOUNDS = ("none", "quick", "tight")

#: More would need more memory than a rig's computer has, and change no plan.
MAX_SAMPLES = 2_000_000

MAX_SHOTS = 16

MAX_VIEWS = 8

#: More of them, each with its rays to cast, belong into several plans.
MAX_SUBJECTS = 64


@documented
@dataclass(frozen=True)
class PlanRequest:
    """What to plan with.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    # Command-line options, node parameters and conversions from and to messages are derived from
    # these fields.
    method: str = specified(
        "k_view",
        FieldSpec(
            "solver: the baselines closest (what autofocus does) and average, the paper's em and"
            " k_view, greedy (camera after camera), or optimal, which proves its plan to be within"
            " ``gap`` of the best",
            choices=METHODS,
        ),
    )
    samples: int = specified(
        4096,
        FieldSpec(
            "number of surface samples to plan on, of each subject; 0 takes a cloud's own points,"
            " or on a mesh as many samples as ``standard_error`` calls for",
            at_least=0,
            at_most=MAX_SAMPLES,
        ),
    )
    seed: int = specified(
        0,
        FieldSpec(
            "seed of the random sampling; the same inputs and seed give the same plan", at_least=0
        ),
    )
    k: int = specified(
        2,
        FieldSpec(
            "number of cameras that k_view optimises together; all, if there are fewer",
            choices=(2, 3),
        ),
    )
    scope: str = specified(
        "all",
        FieldSpec(
            "samples that a k_view step may reassign: all that its cameras see or, as in the paper,"
            " only those assigned to them",
            choices=SCOPES,
        ),
    )
    tuples: str = specified(
        "overlap",
        FieldSpec(
            "which cameras k_view optimises together: those that see the same surface (overlap), or"
            " neighbours on the rig's grid",
            choices=TUPLES,
        ),
    )
    time_budget: float = specified(
        np.inf,
        FieldSpec(
            "time limit: the best plan found by then is returned, with its bound; samples that"
            " cannot be ray-cast within half of it are left out",
            unit="seconds",
            at_least=0,
            unlimited=True,
        ),
    )
    shots: int = specified(
        1,
        FieldSpec(
            "number of pictures that each camera takes, each with its own focus distance, all"
            " planned together",
            at_least=1,
            at_most=MAX_SHOTS,
        ),
    )
    views: int = specified(
        1,
        FieldSpec(
            "number of views that each piece of surface needs: it is planned to be sharp in so many"
            " cameras; photogrammetry takes 3 or more",
            at_least=1,
            at_most=MAX_VIEWS,
        ),
        kw_only=True,
    )
    images: int = specified(
        0,
        FieldSpec(
            "largest number of pictures that all cameras take together, placed where they pay: each"
            " camera takes at most ``shots`` of them, and some may take none; 0 for no limit",
            at_least=0,
            at_most=MAX_CAMERAS,
        ),
        kw_only=True,
    )
    depth_tolerance: float = specified(
        0.0,
        FieldSpec(
            "depth error to allow for: a sample counts as in focus only if it stays in focus when"
            " its depth is off by this much either way; more than about half of the standard error"
            " of depths costs more coverage than it saves",
            unit="metres",
            at_least=0,
            at_most=MAX_COORDINATE,
        ),
    )
    max_mm_per_pixel: float = specified(
        np.inf,
        FieldSpec(
            "coarsest resolution that counts, along the surface: what a camera images with more"
            " millimetres per pixel counts as unseen by it",
            unit="mm per pixel",
            at_least=0,
            unlimited=True,
        ),
        kw_only=True,
    )
    fresh_samples: int = specified(
        4096,
        FieldSpec(
            "number of further samples of each subject, unseen by the solver, on which the plan's"
            " quality is estimated",
            at_least=2,
            at_most=MAX_SAMPLES,
        ),
    )
    standard_error: float = specified(
        2.0,
        FieldSpec(
            "standard error wanted for the cost on fresh samples, in the cost's unit; applies only"
            " with ``samples`` 0 on a mesh, where it sets the numbers of samples and fresh samples",
            above=0,
        ),
    )
    bound: str = specified(
        "quick",
        FieldSpec(
            "effort spent on a lower bound of the cost: none, quick (about as long as a 2-view plan"
            " takes) or tight (until it hardly rises); optimal always proves its own",
            choices=BOUNDS,
        ),
    )
    gap: float = specified(
        1e-4,
        FieldSpec(
            "how close to the best possible cost a proven plan has to be, as a fraction of its"
            " cost: optimal stops there, and so does a tight bound",
            at_least=0,
            at_most=1,
            at_most_is="the whole cost",
        ),
    )
    worst: bool = specified(
        False,
        FieldSpec(
            "plan several subjects for the one that costs most, so that it costs as little as it"
            " can, rather than for their mean"
        ),
    )

    def __post_init__(self) -> None:
        for each in specified_fields(type(self)):
            value = getattr(self, each.name)
            each.check(value)
            if each.spec.unlimited and value == 0:
                object.__setattr__(self, each.name, np.inf)
