"""What tests of pages share: tables read back, pictures taken before they are drawn, results that nobody remembers."""

from functools import cache

from matplotlib.figure import Figure


def tables(markdown):
    """The tables of a text, each a list of rows by header."""
    found, header = [], None
    for line in markdown.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if not line.startswith("| "):
            header = None
        elif header is None:
            header = cells
            found.append([])
        elif cells[0] != "---":
            found[-1].append(dict(zip(header, cells, strict=True)))
    return found


class Drawn:
    """Takes the place of `curve_picture` in a module: keeps the panels, applies the style to empty axes."""

    def __init__(self, monkeypatch, module):
        monkeypatch.setattr(module, "curve_picture", self)
        self.axes = Figure().subplots()

    def __call__(self, label, panels, style=None):
        self.label, self.panels = label, panels
        if style is not None:
            style(self.axes)
        return b"drawn"


def remember_apart(monkeypatch, module, *names):
    """Give cached functions other memories for the time of a test: what it makes small must not reach the others."""
    for name in names:
        monkeypatch.setattr(module, name, cache(getattr(module, name).__wrapped__))
