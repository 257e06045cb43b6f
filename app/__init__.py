"""HTTP service and command line, thin over routing and energy."""
