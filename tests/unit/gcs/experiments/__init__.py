"""The paper's experiments: runs, statistics, what is resumed."""
