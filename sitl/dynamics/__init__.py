"""The physical fleet: airframes, rigid bodies, wind and contact, all compiled, in steps of 4 ms."""
