"""`python -m sitl` is the console script `sitl`."""

from sitl.cli import main

main()
