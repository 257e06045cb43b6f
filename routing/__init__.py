"""Road graphs, their import, the label-setting search on them, and reachable areas."""
