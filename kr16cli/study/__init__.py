"""Studies: maps over the workspace, sweeps of parameters, and uncertainty.

A study is a table that is computed chunk by chunk (`work`), kept on disk while it grows (`store`)
and run by threads, processes or a Dask cluster (`engine`, `cluster`). No number depends on how
it was cut up, or by whom it was computed.
"""
