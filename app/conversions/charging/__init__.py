"""Charging stops between schemas and routing.charging: what is asked for, and the plans that are answered."""
