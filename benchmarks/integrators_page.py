"""Write the figures of `benchmarks/results/integrators.csv` into docs/integrators.md and draw its picture.

python -m benchmarks.integrators_page
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import log
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from benchmarks.integrators import NAMES
from benchmarks.make_page import page_with
from fem_needle.pictures import COLORS, new_figure, png_bytes, shared_style

ROOT = Path(__file__).parents[1]
RESULTS, PAGE = ROOT / "benchmarks" / "results" / "integrators.csv", ROOT / "docs" / "integrators.md"
PICTURE = ROOT / "docs" / "pictures" / "integrators.png"
GUIDE, VIBRATION, PUSH, CUT = "rigid guide, hub jerked", "first vibration, 1000 periods", "push with kinks", "cut path"
ERRORS = (1e-2, 1e-3, 1e-4, 1e-5)
MARKERS = ("o", "s", "^", "D", "v")
Rows = list[dict[str, str]]


def read(path: Path = RESULTS) -> Rows:
    """Return the rows of the results."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def of(rows: Rows, case: str, method: str) -> Rows:
    """Return the rows of a method in a case, long steps first."""
    return [row for row in rows if row["case"] == case and row["method"] == method]


def every(rows: Rows, key: str) -> list[str]:
    """Return the values of a column, each once, in order."""
    return list(dict.fromkeys(row[key] for row in rows))


def moving_cases(rows: Rows) -> list[str]:
    """Return the cases of needles that move in tissue."""
    return [case for case in every(rows, "case") if case not in {GUIDE, VIBRATION, PUSH, CUT}]


def table(header: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """Return a table of a document."""
    return "".join(f"| {' | '.join(line)} |\n" for line in (header, ["---"] * len(header), *lines)) + "\n"


def milliseconds(seconds: float) -> str:
    """Return a time [s] in ms with two digits."""
    return f"{float(f'{1e3 * seconds:.2g}'):g}"


def time_to(rows: Rows, error: float) -> str:
    """Return the time [ms] at which the error first falls to a value, between steps along a power; nothing where it does not."""
    seconds, found = [float(row["seconds"]) for row in rows], [float(row["error"]) for row in rows]
    if found[0] <= error:
        return f"< {milliseconds(seconds[0])}"
    for (before, after), (first, last) in zip(pairwise(found), pairwise(seconds), strict=True):
        if after <= error:
            return milliseconds(first * (last / first) ** (log(before / error) / log(before / after)))
    return ""


def times(rows: Rows, case: str) -> str:
    """Return what each method takes to some errors, and for a step."""
    methods = every([row for row in rows if row["case"] == case], "method")
    lines = []
    for method in methods:
        own = of(rows, case, method)
        step = min(1e6 * float(row["seconds"]) / float(row["steps"]) for row in own)
        lines.append([method, f"{step:.1f}", *(time_to(own, error) for error in ERRORS)])
    doubt = float(of(rows, case, methods[0])[0]["doubt"])
    header = ["method", "a step [us]", *(f"to {error:.0e} [ms]" for error in ERRORS)]
    return f"**{case}** (what is true is known to {doubt:.0e}):\n\n" + table(header, lines)


def by_step(rows: Rows, case: str, cell: Any, name: str = "method") -> str:
    """Return a table over steps; ``cell`` makes the text of a row."""
    own = [row for row in rows if row["case"] == case]
    steps = every(own, "step")
    lines = [[method, *(cell(row) for row in of(rows, case, method))] for method in every(own, "method")]
    return table([name, *steps], lines)


def errors(rows: Rows, case: str) -> str:
    """Return errors over steps of plain methods."""
    own = [row for row in rows if row["case"] == case and row["method"] in NAMES]
    return f"**{case}**, error over the step [s]:\n\n" + by_step(own, case, lambda row: f"{float(row['error']):.1e}")


def guided(row: dict[str, str]) -> str:
    """Return error, spike and residual of a run through a guide."""
    ledger = f" / {float(row['spike']):.2g} N / {float(row['energy']):.0e}" if row["spike"] else ""
    return f"{float(row['error']):.1e}{ledger}"


def vibrating(row: dict[str, str]) -> str:
    """Return change of energy and phase of a vibration."""
    return f"{float(row['energy']):.0e} / " + (f"{float(row['phase']):.1e}" if row["phase"] else "gone")


def figures() -> str:
    """Return the part of the page that the results fill."""
    rows = read()
    parts = [f"From `benchmarks/results/{RESULTS.name}`.\n\n"]
    parts += [times(rows, case) for case in moving_cases(rows)] + [errors(rows, case) for case in moving_cases(rows)]
    parts += [f"**{GUIDE}**: error of the tip / spike of the push / residual of the energy, over the step [s]:\n\n"]
    parts += [by_step(rows, GUIDE, guided)]
    parts += [f"**{VIBRATION}**, undamped: change of energy / of phase [rad], over steps in a period:\n\n"]
    parts += [by_step(rows, VIBRATION, vibrating)]
    parts += ["**A push with kinks**: error of depth and tip, over the step [s]:\n\n"]
    parts += [by_step(rows, PUSH, lambda row: f"{float(row['error']):.1e}")]
    parts += ["**A path that is being cut**: residual of the energy, over the step [s]:\n\n"]
    parts += [by_step(rows, CUT, lambda row: f"{float(row['energy']):.0e}")]
    return "".join(parts)


def picture() -> bytes:
    """Return error against time, a panel for each case."""
    rows = read()
    cases, styles = [*moving_cases(rows), GUIDE], {}
    for number, method in enumerate(NAMES):
        styles[method] = {"color": COLORS[number], "marker": MARKERS[number], "markersize": 5, "linewidth": 1.4}
    with shared_style():
        figure = new_figure(11.4, 7.0)
        axes = [figure.add_subplot(2, 3, number + 1) for number in range(6)]
        for case, panel in zip(cases, axes, strict=False):
            draw(panel, rows, case, styles)
        lines = [Line2D([], [], label=name, **style) for name, style in styles.items()]
        lines.append(Line2D([], [], label="what is true is known to this", color="#909090", linestyle=":"))
        axes[-1].axis("off")
        axes[-1].legend(handles=lines, loc="center left", title="left and down is better", alignment="left", frameon=False)
        return png_bytes(figure)


def draw(axes: Axes, rows: Rows, case: str, styles: dict[str, dict[str, Any]]) -> None:
    """Draw the methods of a case."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    for method, style in styles.items():
        own = of(rows, case, method)
        axes.plot([1e3 * float(row["seconds"]) for row in own], [float(row["error"]) for row in own], **style)
    axes.axhline(float(of(rows, case, "Gauss")[0]["doubt"]), color="#909090", linestyle=":")
    axes.set(xlabel="time of all steps [ms]", ylabel="error of the tip [1]")
    axes.set_title(case, loc="left", fontsize=9)


def main() -> None:
    """Write page and picture."""
    PAGE.write_text(page_with(figures(), PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    PICTURE.write_bytes(picture())


if __name__ == "__main__":
    main()
