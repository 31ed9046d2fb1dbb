"""Applying focus distances to lenses through their drivers, and simulated lenses."""
