"""openrouteservice, version 2: directions, isochrones and matrix (docs/faces.md)."""
