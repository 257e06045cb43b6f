"""Energy of a drive as it was recorded, sample by sample."""
