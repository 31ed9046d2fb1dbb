"""Lenses: what drivers are told, whether they have done it, and simulated ones."""
