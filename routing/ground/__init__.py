"""What lies around the roads of a map: water, woods, built-up land, borders and the names of places."""
