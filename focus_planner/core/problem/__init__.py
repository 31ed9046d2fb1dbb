"""core/problem."""
