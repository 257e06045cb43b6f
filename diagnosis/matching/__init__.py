"""Positions matched to roads."""
