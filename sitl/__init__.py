"""A lightweight simulator of multirotors that fly and talk like PX4.

Layers, each importing only what stands below it: `cli` > `service` > `link.udp` > `simulator` > `fault_injection`,
`vehicle` > `microservices` > `autopilot`, and beside these three `fleet` > `control`, `estimator` > `dynamics`. What
an autopilot sees of its vehicle is a `snapshot`, what it orders is written into the vehicle's record
(`dynamics.state`).

Everything from `simulator` down is sans-IO: a fleet of vehicles advances by ticks of 20 ms on a virtual clock, takes
datagrams and hands out datagrams. docs/simulator.md says what is simulated and what is not.
"""
