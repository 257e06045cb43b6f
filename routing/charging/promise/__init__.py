"""What a plan with charging stops promises: how sure each stop is, and what is there if one fails."""
