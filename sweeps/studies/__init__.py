"""Studies: sweeps in TOML for `jaxbiped sweep`, and scripts that run as `python -m sweeps.studies.NAME`."""
