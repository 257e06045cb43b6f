"""Journeys with charging stops: which stations, how long, and what is proven of the plan."""
