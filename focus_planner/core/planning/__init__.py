"""From request to plan: formulating, solving within a deadline, estimating the plan's quality."""
