"""OSRM 5: its services route, table and nearest (docs/faces.md)."""
