"""When one label makes another superfluous, and the bounds that this rests on."""
