"""Recordings, whole and damaged."""
