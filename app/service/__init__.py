"""The use cases that HTTP, command line and batches share."""
