"""The paper's experiments, repeated: what it publishes, what a mission's time went to, and the test scenes."""

from jaxbiped.study.reproduction.account import Measuring, Part, Record, fit_measuring, record, typical
from jaxbiped.study.reproduction.paper import EXPERIMENTS, PUBLISHED, SAVED, TABLE_1, Experiment, expected

__all__ = [
    "EXPERIMENTS",
    "PUBLISHED",
    "SAVED",
    "TABLE_1",
    "Experiment",
    "Measuring",
    "Part",
    "Record",
    "expected",
    "fit_measuring",
    "record",
    "typical",
]
