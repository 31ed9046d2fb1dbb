"""Rigs from the files of other programs: one module per program."""
