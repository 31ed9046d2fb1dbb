"""Shared by tests and benchmarks: oracles, scenes, made-up messages and runs, processes."""
