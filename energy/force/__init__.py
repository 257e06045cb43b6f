"""Forces on a vehicle on one link, and what conditions add to them."""
