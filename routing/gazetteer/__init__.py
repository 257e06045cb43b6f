"""Streets, places, house numbers and points of interest by name and by place: built, stored, searched."""
