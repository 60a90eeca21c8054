"""When the cloud plans anew, and what of it is flown."""
