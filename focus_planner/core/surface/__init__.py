"""core/surface."""
