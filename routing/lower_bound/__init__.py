"""Least cost from a link to the goal, which directs a search."""
