"""Measurements that are too long for tests: ours beside peers, with required figures."""
