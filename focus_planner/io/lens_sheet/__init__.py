"""Lens sheets: what a person sets on every lens, as a table to print or to read on."""

#: The ends of names of lens sheets. Here, because finding out what to write takes no time.
SUFFIXES = (".csv", ".html", ".pdf")
