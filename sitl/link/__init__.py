"""What lies between the vehicles and the outside.

`udp` (sockets and pace) and `truth_log` stand above the simulator; `ground_link`, faults on simulated time, below it.
"""
