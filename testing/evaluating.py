# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A program that runs an experiment on a worker of its own: ``evaluating.py FOLDER SUBJECTS``."""

import sys
from pathlib import Path

from focus_planner.evaluation.results.store import opened
from focus_planner.evaluation.running.connecting import local_cluster
from focus_planner.evaluation.running.running import run
from testing.experiments import CONDITIONS, SLOW, boxes

if __name__ == "__main__":
    subjects = boxes(int(sys.argv[2]))
    try:
        with (
            opened(Path(sys.argv[1]), CONDITIONS, subjects) as store,
            local_cluster(1) as where,
        ):
            run(SLOW, subjects, CONDITIONS, store, where)
    except KeyboardInterrupt:
        sys.exit(130)
