# PYTHON_ARGCOMPLETE_OK
"""The command line as ``python -m focus_planner``."""

import sys

from focus_planner.cli.main import main

sys.exit(main())
