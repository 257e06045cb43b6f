"""The HTTP interface: endpoints, limits, the web map."""
