"""Companions among themselves: announcements, right of way, the roster."""
