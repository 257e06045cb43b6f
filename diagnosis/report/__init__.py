"""The diagnosis as a page to read."""
