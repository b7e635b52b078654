"""The map of one view compiled for a CPU: the rules of `mapping.gridmap`, `cobstacles` and `relief`, in loops.

XLA spends several times as long on these few thousand numbers, most of it between its many small operations. Functions
here say which of those they repeat. Arrays are flat, and arrays of cells have a margin all around, so that neighbours
are at fixed distances and no loop asks for the rim.

What Numba compiles fast and LLVM vectorises: no slices but places in whole arrays, as unsigned numbers (which never
count from the end), and results in other arrays than what they are made of.
"""
