# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The experiments: one per file, which is called as it is on the command line."""

from focus_planner.evaluation.experiment import Experiment
from focus_planner.evaluation.experiments import (
    aperture,
    cameras,
    convergence,
    fresh,
    geometry,
    initialisation,
    k,
    optimum,
    overlap,
    removal,
    rings,
    table1,
    table2,
    taped,
    views,
)

#: In the order in which the page has them.
EXPERIMENTS: dict[str, Experiment] = {
    each.name: each
    for each in (
        table1.EXPERIMENT,
        table2.EXPERIMENT,
        cameras.EXPERIMENT,
        overlap.EXPERIMENT,
        rings.EXPERIMENT,
        k.EXPERIMENT,
        initialisation.EXPERIMENT,
        convergence.EXPERIMENT,
        optimum.EXPERIMENT,
        fresh.EXPERIMENT,
        geometry.EXPERIMENT,
        aperture.EXPERIMENT,
        removal.EXPERIMENT,
        views.EXPERIMENT,
        taped.EXPERIMENT,
    )
}

__all__ = ["EXPERIMENTS"]
