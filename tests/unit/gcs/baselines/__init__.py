"""The algorithms that the cloud planner is compared with."""
