"""All tests, the whole system in one process, benchmarks, experiments, soak, fuzz: what needs several packages."""
