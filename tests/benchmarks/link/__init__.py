"""The ground link's benchmark: `make bench-link`."""
