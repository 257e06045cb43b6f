"""What compiled code needs of its surroundings: its cache, and arrays that are borrowed."""
