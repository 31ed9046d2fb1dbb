"""The discrete problem that solvers work on: samples, camera pairs, their costs, focus cells."""
