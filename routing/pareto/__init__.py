"""The Pareto set of time and energy, and its proofs."""
