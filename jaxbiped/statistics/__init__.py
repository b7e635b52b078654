"""Paired statistics of strategies, as pure functions of the rows of a study."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(
    __name__,
    {
        "comparison": "ALL QUESTION Comparison PairComparison StrategySummary Stratum compare default_pairs",
        "equivalence": "Equivalence equivalences",
        "intervals": "Estimate mean_and_median paired_difference proportion",
        "multiple_testing": "holm",
        "paired": (
            "PairedMetric equivalent_mean equivalent_success improvement mcnemar metric_difference signed_rank "
            "success_difference"
        ),
        "power": "connor_sample_size mcnemar_power sample_size",
        "sample_size_plan": "Plan paired_t_sample_size plan",
        "schema": "CODES FAMILIES KNOWN SCHEMA STRATEGIES validate",
        "sequential": "Goal Watch enough look",
    },
)
