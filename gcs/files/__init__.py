"""Plans, areas and tracks in the files of other tools: QGroundControl, MAVProxy, Google Earth, GIS programs.

Every format is read into one `PlanDocument` and written from one. What a format cannot hold is refused, not dropped.
"""
