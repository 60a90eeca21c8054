"""The local map, its distances, and what moves in it."""
