"""The source's published tables, computed again."""
