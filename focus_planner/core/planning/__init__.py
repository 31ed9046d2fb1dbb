"""core/planning."""
