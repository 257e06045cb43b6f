"""Files of charging stations, a module a format."""
