"""Simulated drives held beside recorded ones: how large the errors are, and where they sit."""
