"""Signing, keys, the audit log, and attacks on them."""
