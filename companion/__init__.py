"""One process per vehicle: onboard planner, pilot, and offboard setpoints through MAVSDK.

Layers, each importing only what stands below it: `cli` > `app` (the supervisor: carries out what the pilot wants) >
`pilot` (the state machine) > `engagement`, `flight` > `course`, `crew`, `briefing`, `setpoints` > `planner` >
`settings`. `link` (the vehicle) stands beside the pilot: the two know each other by `events` and `instructions` alone.

Everything from the pilot down is sans-IO. Sockets are MAVSDK's, which `link.px4` alone knows; threads begin there and
in `cli`, which gives the planner one of its own; the clock is the event loop's. docs/companion.md has the states.
"""
