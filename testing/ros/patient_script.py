"""Runs the script that is its first argument, as ``python`` does; its clients wait for long."""

import runpy
import sys

from testing.ros.patient_clients import have_clients_wait

have_clients_wait()
del sys.argv[0]
runpy.run_path(sys.argv[0], run_name="__main__")
