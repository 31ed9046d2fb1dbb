"""Pictures of what cameras will see, with their blur."""
