"""What the autopilot decides: modes, arming, failsafes, missions, offboard setpoints. No MAVLink frames, no clock.

Layers: `autopilot` > `navigator` (flies modes) > `mission_flight`, `flight_modes`, `geofence` > `craft` (what they need
of a vehicle), `offboard` > `flight_control` (orders to the compiled control); beside the navigator `commander` (chooses
modes, arms) > `failsafe`. Below all: `parameters`, `modes`, `places`, `plan`, `reports`.
"""
