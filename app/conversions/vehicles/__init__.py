"""Parts of vehicles between human units and the energy package."""
