"""The manual as a site, built out of the pages of the repository and from the code."""
