"""Every shipped mission flown in full, end and cloud together, by the whole system in one process."""
