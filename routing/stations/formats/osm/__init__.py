"""Charging stations of OpenStreetMap: what their tags mean, and reading them from a map file."""
