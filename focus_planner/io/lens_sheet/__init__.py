"""Lens sheets: what a person sets on every lens, as a table to print or to read on."""
