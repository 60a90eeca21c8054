"""The simulator: physics, autopilot, MAVLink services."""
