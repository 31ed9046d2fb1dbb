"""The command line, as its console script runs it."""

import sys

from focus_planner.cli.main import main

sys.exit(main())
