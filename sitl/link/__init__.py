"""What lies between the vehicles and the outside: sockets, the faults of the ground link, the truth log."""
