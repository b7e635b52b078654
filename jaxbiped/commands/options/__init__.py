"""The options of each command: light to import, so that help and wrong options are answered at once."""
