"""Nodes in processes of their own, and clients that talk to them."""
