"""Who may speak as a vehicle, and how the ground station proves that it is the one: MAVLink 2 signing and its keys."""
