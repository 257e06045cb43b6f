"""The causes that a mismatch can have: families, terms, candidates, nuisance columns."""
