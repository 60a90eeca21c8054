"""Hostile traffic: `make fuzz SECONDS=60`. Receive paths are listed in `tests.fuzz.targets.TARGETS`."""
