"""Experiments that fly the whole system in process."""
