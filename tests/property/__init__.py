"""What holds for all inputs, found by hypothesis."""
