"""The charging stations of a graph as they are asked for over HTTP and on the command line."""
