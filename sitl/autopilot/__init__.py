"""What the autopilot decides: modes, arming, failsafes, missions, offboard setpoints. No MAVLink frames, no clock."""
