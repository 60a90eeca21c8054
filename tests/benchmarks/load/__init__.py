"""What a fleet costs in the long run: `python -m tests.benchmarks.load` (`make bench-load`).

The real simulator with 100 vehicles that fly circles, the real `gcs watch` with its page, over UDP, for minutes: memory
of both, what waits in their sockets, and how old positions become. docs/scaling.md says how to read what it prints.
"""
