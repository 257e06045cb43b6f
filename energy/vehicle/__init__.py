"""A vehicle: its parameters, its files, what is published of it, and what it is checked against."""
