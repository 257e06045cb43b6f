"""Measurements of speed and memory, printed as ratios in one run; nothing here is timed in a test."""
