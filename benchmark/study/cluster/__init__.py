"""Episodes on a Dask cluster: only this package knows Dask."""
