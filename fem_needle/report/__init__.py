"""Reports: a run folder or the folder of a study as one printable HTML page that needs no network."""

from fem_needle.report.folder import read_folder
from fem_needle.report.page import html_page, write_report
from fem_needle.report.parts import Chart, Grid, Page, Picture, Section

__all__ = ["Chart", "Grid", "Page", "Picture", "Section", "html_page", "read_folder", "write_report"]
