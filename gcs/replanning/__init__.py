"""Replanning in flight: when the cloud plans anew, what it plans for, and which of its answers are flown. Sans-IO."""
