"""A lightweight simulator of multirotors that fly and talk like PX4.

Layers, each importing only what stands below it: `cli` > `service` > `link` > `simulator` > `vehicle` >
`microservices` > `autopilot` > `fleet` > `control`, `estimator` > `dynamics`. Everything below `link` is sans-IO:
a fleet of vehicles advances by ticks of 20 ms on a virtual clock, takes datagrams and hands out datagrams.
"""
