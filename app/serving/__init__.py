"""Several processes that serve as one: a supervisor, and workers on one socket and on one copy of the graphs."""
