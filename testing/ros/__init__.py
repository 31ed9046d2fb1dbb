"""Nodes in processes of their own, and what is said to them."""
