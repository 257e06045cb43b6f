"""joulepath from Python."""
