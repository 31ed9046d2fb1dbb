"""What tests and benchmarks share: oracles, scenes, made-up messages and runs, processes."""
