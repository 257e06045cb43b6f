"""Which of many stations a journey may call at, and whether any leads to its goal: by searches of all at once."""
