"""Many requests at a time: read from files, answered on Dask, written to files."""
