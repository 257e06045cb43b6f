"""How candidates are fitted to the residuals of trips, and chosen."""
