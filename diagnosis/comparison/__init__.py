"""Recorded trips beside predicted ones, without a diagnosis."""
