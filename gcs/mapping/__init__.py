"""What the fleet has seen of the world: the observations of all vehicles in one map."""
