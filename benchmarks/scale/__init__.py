"""`joulepath bench --scale`: what grows with the graph, and what does not."""
