"""The command line; each command asks the same use cases as HTTP."""
