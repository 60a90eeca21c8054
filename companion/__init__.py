"""One process per vehicle: onboard planner, pilot, and offboard setpoints through MAVSDK.

Layers, from the top down: `cli` > `app` (the supervisor) > `link` (the vehicle) and `pilot` (the state machine)
> `planner` > `missions`. Only `link/px4` knows MAVSDK; nothing else knows sockets or threads, and no clock but the
event loop's. docs/companion.md has the states.
"""
