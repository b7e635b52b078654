"""Planners that the examples and the study of outside planners play."""
