"""Studies: many missions, and the store of their results."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(
    __name__,
    {
        "stored_series": "Side Stored choose compare_sides open_stored",
        "store": "Manifest Store StoredRows StudyHeader create read read_manifest read_points scan",
    },
)
