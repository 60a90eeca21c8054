"""The real programs as processes over UDP, and programs of others: MAVSDK, MAVProxy."""
