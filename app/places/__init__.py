"""Places by name: searched for, found by coordinates, and named in requests in place of coordinates."""
