"""The vehicle: an interface, and the one that speaks to real autopilots through MAVSDK.

Layers: `px4` (MAVSDK, threads) > `messages` (fields as JSON to events, pure). `autopilot` is the interface that `app`
knows; `px4` is one, tests have another.
"""
