"""Valhalla 3: route, isochrone, sources_to_targets, height, locate and status (docs/faces.md)."""
