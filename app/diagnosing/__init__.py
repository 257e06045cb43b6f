"""Diagnoses carried out: in a command, or as jobs of the service."""
