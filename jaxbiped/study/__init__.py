"""Paired statistics of strategies, and the store of their results."""

from jaxbiped.study.comparison import (
    ALL,
    QUESTION,
    Comparison,
    PairComparison,
    StrategySummary,
    Stratum,
    compare,
    default_pairs,
)
from jaxbiped.study.equivalence import Equivalence, equivalences
from jaxbiped.study.intervals import Estimate, mean_and_median, paired_difference, proportion
from jaxbiped.study.paired import (
    PairedMetric,
    equivalent_mean,
    equivalent_success,
    holm,
    improvement,
    mcnemar,
    metric_difference,
    signed_rank,
    success_difference,
)
from jaxbiped.study.pilot import Plan, paired_t_sample_size, plan
from jaxbiped.study.power import connor_sample_size, mcnemar_power, sample_size
from jaxbiped.study.schema import CODES, FAMILIES, KNOWN, SCHEMA, STRATEGIES, validate
from jaxbiped.study.sequential import Goal, Watch, enough, look
from jaxbiped.study.sides import Side, Stored, choose, compare_sides, open_stored
from jaxbiped.study.store import Manifest, Store, create, read, read_manifest, read_points, scan

__all__ = [
    "ALL",
    "CODES",
    "FAMILIES",
    "KNOWN",
    "QUESTION",
    "SCHEMA",
    "STRATEGIES",
    "Comparison",
    "Equivalence",
    "Estimate",
    "Goal",
    "Manifest",
    "PairComparison",
    "PairedMetric",
    "Plan",
    "Side",
    "Store",
    "Stored",
    "StrategySummary",
    "Stratum",
    "Watch",
    "choose",
    "compare",
    "compare_sides",
    "connor_sample_size",
    "create",
    "default_pairs",
    "enough",
    "equivalences",
    "equivalent_mean",
    "equivalent_success",
    "holm",
    "improvement",
    "look",
    "mcnemar",
    "mcnemar_power",
    "mean_and_median",
    "metric_difference",
    "open_stored",
    "paired_difference",
    "paired_t_sample_size",
    "plan",
    "proportion",
    "read",
    "read_manifest",
    "read_points",
    "sample_size",
    "scan",
    "signed_rank",
    "success_difference",
    "validate",
]
