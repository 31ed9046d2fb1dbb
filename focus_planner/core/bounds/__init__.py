"""Lower bounds on the cost of any plan, up to proofs of optimality."""
