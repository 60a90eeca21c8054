"""Commands of `gcs` that are more than a line, each with its options and help; `gcs.cli` registers them."""
