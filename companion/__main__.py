"""`python -m companion` is the console script `companion`."""

from companion.cli import main

main()
