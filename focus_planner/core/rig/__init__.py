"""core/rig."""
