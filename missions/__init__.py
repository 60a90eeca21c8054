"""What is to be flown, where and by whom, and the maths that all programs share.

This package is the bottom of the house: `gcs`, `companion` and `sitl` import it, it imports none of them.
It is pure: no sockets, no event loop, no MAVLink library, no clock. The mission files (`*.yaml`) that the
project ships live here too.
"""
