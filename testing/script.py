"""Runs the script that is its first argument, as ``python`` does."""

import runpy
import sys

del sys.argv[0]
runpy.run_path(sys.argv[0], run_name="__main__")
