"""The paper's tables and figures, and measurements of our own, each by one command: `gcs experiment NAME`.

Layers, each importing only what stands below it:

    command                                  runs what is missing, writes rows, pictures and a summary
    catalogue                                experiments by name
    ackley, allocation, paths, convergence, table2, ablation, scaling    one experiment each
    runner, executors                        runs on this machine's cores, or on a Dask cluster
    trials                                   one search, measured
    ledger                                   the CSV file; interrupted experiments go on
    drawing, scenery, markdown, series, statistics, paper    pictures, tables, tests, the paper's numbers
    experiment                               what an experiment consists of
"""
