"""The observed map of the whole fleet."""
