"""The onboard planner: search, archive, limits, ways around."""
