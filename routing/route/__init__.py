"""From a query for one route to its answer."""
