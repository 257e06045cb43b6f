"""HTTP endpoints, a module for each noun."""
