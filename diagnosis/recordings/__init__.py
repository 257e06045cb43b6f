"""Recorded drives: read, checked and mended."""
