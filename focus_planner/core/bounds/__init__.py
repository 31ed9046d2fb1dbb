"""Bounds: what no plan can be better than."""
