"""What a vehicle carries beside its autopilot's own sensors: the companion's range sensor."""
