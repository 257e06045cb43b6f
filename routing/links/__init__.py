"""What a vehicle sees of each link: its energy, stops and known drives."""
