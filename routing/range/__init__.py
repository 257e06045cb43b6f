"""Reachable areas, forwards and backwards, and their outlines."""
