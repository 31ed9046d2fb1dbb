"""Formats of surface files, one module each: path in, what the file holds out."""
