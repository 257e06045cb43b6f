"""Steps of routes into answers."""
