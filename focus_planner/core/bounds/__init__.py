"""Lower bounds on the cost of every plan: Lagrangian prices, and branch and bound on them."""
