"""Of the simulation in one process: its virtual time."""
