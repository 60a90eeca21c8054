"""What the vehicle sees: drivers of range sensors, whose packets become scans in the mission's frame."""
