"""The judges of experiments."""
