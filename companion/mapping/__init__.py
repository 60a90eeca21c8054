"""What the vehicle has seen: a rolling map with a distance field, and what moves in it.

`local_map` is the door: scans go in, a `View` comes out that is never changed afterwards. Below it `movers` (clusters,
tracks, velocities), `occupancy` (which voxels are occupied) and `distance_field` (how far it is to them).
"""
