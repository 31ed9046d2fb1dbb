"""Reading and writing files: surfaces, rig.yaml, plan.json, lens sheets, problem.npz, pictures."""
