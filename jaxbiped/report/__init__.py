"""Pictures, films, tables, figures and summaries."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(
    __name__,
    {
        "animation": "save_gif",
        "pictures": "MapOverlay draw_map save_map save_mission",
        "comparison_report": "Report",
        "sweep": "SweepReport",
        "folder_report": "write_report",
        "tables": "comparison_table terminal",
    },
)
