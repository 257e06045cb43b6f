"""One module for each format of recordings."""
