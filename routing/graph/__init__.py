"""The road graph: its arrays, its files, and places snapped to it."""
