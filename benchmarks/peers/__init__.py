"""Routes and ranges of this service beside those of RouteE Compass and Valhalla, in one run on the same map."""
