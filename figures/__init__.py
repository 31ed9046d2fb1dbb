"""Every picture in README and docs, made anew from real runs: ``make figures``."""
