"""The one executor: how work is spread over this process, threads, processes or a Dask cluster.

`engine` says which engine is in force and reads its name, `local` and `cluster` hold the engines, `shared_memory`
spreads pieces that fill one array of this process, and `workers` decides how many workers there are.
"""
