"""One module or part each, without processes and without waiting; folders as in the packages."""
