"""Energy along a chain of links, by the link model and in time steps."""
