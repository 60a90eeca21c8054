"""The physical fleet, compiled, in steps of 4 ms.

Layers: `rigid_body`, `contact` > `airframe`, `rotation` > `state` (one record per vehicle, truth and everything else).
"""
