"""Answers as files that other programs read: GPX, KML, GeoParquet, CSV."""
