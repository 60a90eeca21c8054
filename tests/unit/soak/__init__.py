"""Of the soak itself."""
