"""Pictures, films, tables, figures and summaries."""

from jaxbiped.report.animation import save_gif
from jaxbiped.report.pictures import draw_map, save_map, save_mission
from jaxbiped.report.summary import Report, write_report
from jaxbiped.report.tables import comparison_table, terminal

__all__ = ["Report", "comparison_table", "draw_map", "save_gif", "save_map", "save_mission", "terminal", "write_report"]
