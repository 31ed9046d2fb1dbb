"""Attacks on the node, from this machine's loopback only; the node has to hold.

``python -m benchmarks attacks`` carries out all of them, ``attacks.race`` one kind.
"""

from __future__ import annotations

from importlib import import_module

from rich.console import Console

# From what is recorded and read to who may do what.
_KINDS = (
    "race",
    "disk",
    "recovery",
    "loaders",
    "crowding",
    "claims",
    "exposure",
    "lifecycle",
    "drivers",
    "protocol",
)


def run(console: Console) -> bool:
    """Print the tables; return whether all attacks held."""
    kinds = [import_module(f"benchmarks.attacks.{kind}") for kind in _KINDS]
    held = [kind.run(console) for kind in kinds]
    return all(held)
