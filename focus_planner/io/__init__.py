"""Reading and writing files: surfaces, rig.yaml, plan.json, problem.npz, pictures."""
