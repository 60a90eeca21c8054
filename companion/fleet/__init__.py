"""The fleet link's core: what vehicles tell each other of their plans, and who goes first. Pure, no socket.

`neighbour` is what the planner gets to see: other vehicles with their trajectories in this vehicle's own time.
"""
