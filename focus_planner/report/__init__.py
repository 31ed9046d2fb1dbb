"""Reports: a plan as a page to look at."""
