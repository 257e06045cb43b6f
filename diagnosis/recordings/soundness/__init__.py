"""What is wrong with a recording, and what can be mended."""
