"""PX4's control cascade, compiled: `guidance` (on `smoothing`) -> `position_control` -> `attitude_control` -> rotors.

`land_detection` watches beside it; `gains` are the parameters that all of them read.
"""
