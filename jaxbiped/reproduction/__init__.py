"""The experiments of the paper, repeated: its published figures, where a mission's time goes, test scenes, the page."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(
    __name__,
    {
        "account": "Measuring Part Record fit_measuring record typical",
        "paper": "EXPERIMENTS PUBLISHED SAVED TABLE_1 Experiment expected",
    },
)
