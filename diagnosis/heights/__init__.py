"""Heights of drives that recorded none, from elevation files and from the graph that they were driven on."""
