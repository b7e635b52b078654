"""The paper's experiments, repeated: what it publishes, what a mission's time went to, and the test scenes."""

from jaxbiped.core.lazy_package import lazy_package

lazy_package(
    __name__,
    {
        "account": "Measuring Part Record fit_measuring record typical",
        "paper": "EXPERIMENTS PUBLISHED SAVED TABLE_1 Experiment expected",
    },
)
