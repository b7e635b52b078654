"""The options of each command: quick to import, so that help and wrong options are answered at once."""
