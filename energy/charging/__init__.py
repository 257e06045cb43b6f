"""How a vehicle takes charge: plugs, power by charge, and time from one charge to another."""
