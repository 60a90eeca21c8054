"""The companion's parts, and whole flights of it in process."""
