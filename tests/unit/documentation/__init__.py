"""The documentation: what it names exists, what it shows works."""
