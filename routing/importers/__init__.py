"""Readers that turn outside map and elevation data into a RoadGraph."""
