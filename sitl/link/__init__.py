"""What lies between the vehicles and the outside.

`udp` (sockets and pace), `control_port` and `truth_log` stand above the simulator; `faulty_link`, faults on simulated
time, below it.
"""
