"""What is known of the compiled planners without loading Numba."""

METHODS = ("line_sweep", "dijkstra")
LANES = 16  # arenas a vector of line sweeps: a few of their maps fit the cache of one core
