"""Steps of the database, each a revision that names the one before it."""
