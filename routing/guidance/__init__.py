"""What a driver is told along a route: where to turn, by which name, number and exit."""
