"""Tiles for web maps: a graph's roads as vector tiles, and its heights as raster-dem tiles."""
