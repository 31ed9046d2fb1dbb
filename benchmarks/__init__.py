"""What the planner takes and gives, measured: ``make bench``."""
