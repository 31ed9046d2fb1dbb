"""The planner node, which waits for a busy machine to write what it has answered."""

import sys

from focus_planner.ros import node
from testing.ros.planner_process import PATIENCE

node._SECONDS_TO_FINISH = float(PATIENCE)

sys.exit(node.main())
