"""Seeded flights of the whole system with everything going wrong, each judged by what must always hold."""
