"""`python -m gcs` is the console script `gcs`."""

from gcs.cli import main

main()
