"""One flight of a fleet, from the first heartbeat to the report."""
