"""Plans and areas in the formats of other tools."""
