"""Charging stations: where they are on the roads, and what they offer."""
