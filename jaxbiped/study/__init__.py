"""Paired statistics of strategies, and the store of their results."""

from jaxbiped.core.lazy_package import lazy_package

lazy_package(
    __name__,
    {
        "comparison": "ALL QUESTION Comparison PairComparison StrategySummary Stratum compare default_pairs",
        "equivalence": "Equivalence equivalences",
        "intervals": "Estimate mean_and_median paired_difference proportion",
        "paired": (
            "PairedMetric equivalent_mean equivalent_success holm improvement mcnemar metric_difference signed_rank "
            "success_difference"
        ),
        "pilot": "Plan paired_t_sample_size plan",
        "power": "connor_sample_size mcnemar_power sample_size",
        "schema": "CODES FAMILIES KNOWN SCHEMA STRATEGIES validate",
        "sequential": "Goal Watch enough look",
        "sides": "Side Stored choose compare_sides open_stored",
        "store": "Manifest Store StoredRows create read read_manifest read_points scan",
    },
)
