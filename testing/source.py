"""Runs source text that is its first argument, as ``python -W error -c`` does."""

import sys
import warnings

warnings.simplefilter("error")
source = sys.argv.pop(1)
exec(compile(source, "<string>", "exec"), {"__name__": "__main__"})
