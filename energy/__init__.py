"""Energy physics of a vehicle on links given as numbers and arrays; knows no graphs and no HTTP."""
