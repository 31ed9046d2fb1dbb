"""Files: surfaces, rig.yaml, plan.json, problem.npz, pictures."""
