"""What is random or damaged, many times each: the node and the command line go on.

``python -m benchmarks fuzz --count 10000`` does all of it, ``fuzz.requests`` one kind.
"""

from __future__ import annotations

from importlib import import_module

from rich.console import Console

_KINDS = ("topics", "requests", "goals", "parameters", "orders", "runs", "files")


def run(console: Console) -> bool:
    """Print the tables; return whether all guarantees held."""
    kinds = [import_module(f"benchmarks.fuzz.{kind}") for kind in _KINDS]
    held = [kind.run(console) for kind in kinds]
    return all(held)
