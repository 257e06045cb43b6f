"""What a driver is told along a route, as it is answered."""
