"""Hands for work that falls into independent tasks: this process, processes of this machine, or a Dask cluster.

Studies and plans for very many users use the same. Results are the same bits wherever they were worked out: a task
knows all that it needs, one thread adds up its sums, and a worker with other versions of the numerical packages is
refused.
"""
