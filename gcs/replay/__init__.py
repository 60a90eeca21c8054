"""Flight recordings played back: read whatever is whole, find any moment fast, and feed the fleet's state from it."""
