"""Benchmarks of the planner's time, memory and plan quality: ``make bench``."""
