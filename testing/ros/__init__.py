"""Nodes in processes of their own, and calls, goals and messages for them."""
