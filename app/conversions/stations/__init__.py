"""Charging stations as every answer has them."""
