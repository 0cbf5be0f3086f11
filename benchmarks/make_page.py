"""Write the figures of the last kept benchmark into docs/benchmark.md and draw its pictures: `python benchmarks/make_page.py`."""

from collections.abc import Iterator, Sequence
from math import isfinite
from pathlib import Path

from fem_needle.benchmark.picture import benchmark_picture
from fem_needle.benchmark.record import read_record
from fem_needle.benchmark.result import Benchmark, Row, ScalingRow
from fem_needle.benchmark.scaling_picture import scaling_picture

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "benchmarks" / "results"
PAGE = ROOT / "docs" / "benchmark.md"
PICTURES = ROOT / "docs" / "pictures"
BEGIN, END = "<!-- begin figures -->\n", "<!-- end figures -->\n"
ERRORS = (1e-3, 1e-6)


def last_record() -> Path:
    """Return the file of the last kept benchmark."""
    return max(RESULTS.glob("*.json"), key=lambda path: read_record(path).date)


def figures(study: Benchmark, name: str) -> str:
    """Return the part of the page that the benchmark fills."""
    machine = study.machine or {}
    known = [key for key in ("python", "numpy", "scipy", "scikit-fem", "numba") if machine.get(key)]
    versions = ", ".join(f"{key} {machine[key]}" for key in known)
    threads = f"{machine.get('blas_threads') or 'any number of'} BLAS threads"
    where = f"{machine.get('processor')}, {machine.get('cores')} cores, {threads}; {versions}"
    parts = [f"From `benchmarks/results/{name}`: {study.date[:10]}, commit `{study.commit}`, {where}.\n"]
    for error in ERRORS:
        title = f"Median time to an error of {error:.0e}; in brackets what was reached instead, and when.\n"
        parts += [title, _times(study, error)]
    if study.goals:
        parts += ["Goals:\n", _goals(study)]
    if study.scaling:
        size = "over elements: 400 steps, 50 with scikit-fem; over duration: 40 elements; else 8 elements"
        parts += [f"Scaling, steps of 1 ms ({size}):\n", _scaling(study.scaling)]
    return "\n".join(parts)


def _times(study: Benchmark, error: float) -> str:
    names = [case.name for case in study.cases]
    lines = _table(("method", *names))
    for method in dict.fromkeys(row.method for row in study.rows):
        rows = [row for row in study.rows if row.method == method and row.median is not None]
        lines.append((method, *(_cell([row for row in rows if row.case == name], error) for name in names)))
    return _text(lines)


def _cell(rows: Sequence[Row], error: float) -> str:
    """Return the shortest time to an error, or the best that was reached."""
    good = [row for row in rows if row.error is not None and row.error <= error]
    if good:
        return time_text(min(row.median or 0.0 for row in good))
    known = [row for row in rows if row.error is not None and isfinite(row.error)]
    if not known:
        return "-"
    best = min(known, key=lambda row: row.error or 0.0)
    return f"({best.error:.0e}, {time_text(best.median or 0.0)})"


def time_text(seconds: float) -> str:
    """Return a time with two digits and a unit."""
    factor, unit = next((pair for pair in ((1.0, "s"), (1e3, "ms"), (1e6, "us")) if seconds * pair[0] >= 1.0), (1e6, "us"))
    return f"{float(f'{seconds * factor:.2g}'):g} {unit}"


def _goals(study: Benchmark) -> str:
    lines = _table(("", "goal", "asked", "measured", "met", "by, or why not measured"))
    for row in study.goals:
        unit = "" if row.unit == "1" else f" {row.unit}"
        measured = "not measured" if row.measured is None else f"{row.measured:.3g}{unit}"
        met = "" if row.met is None else "yes" if row.met else "no"
        lines.append((row.number, row.text, f"{row.goal:.4g}{unit}", measured, met, row.note))
    return _text(lines)


def _scaling(rows: Sequence[ScalingRow]) -> str:
    lines = _table(("over", "method", "size", "step", "run", "memory"))
    for row in rows:
        size = f"{row.size:g}" + (" s" if row.over == "duration" else "")
        if row.per_step is None or row.total is None or row.memory is None:
            lines.append((row.over, row.method, size, row.note, "", ""))
        else:
            memory = f"{float(f'{1e-6 * row.memory:.2g}'):g} MB"
            lines.append((row.over, row.method, size, time_text(row.per_step), time_text(row.total), memory))
    return _text(lines)


def _table(header: tuple[str, ...]) -> list[tuple[str, ...]]:
    return [header, ("---",) * len(header)]


def _text(lines: Sequence[tuple[str, ...]]) -> str:
    def cells(line: tuple[str, ...]) -> Iterator[str]:
        return (cell.replace("|", r"\|") for cell in line)

    return "".join(f"| {' | '.join(cells(line))} |\n" for line in lines)


def page_with(text: str, page: str) -> str:
    """Return the page with new figures in it."""
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    return before + BEGIN + "\n" + text + "\n" + END + after


def main() -> None:
    """Write page and pictures."""
    path = last_record()
    study = read_record(path)
    PAGE.write_text(page_with(figures(study, path.name), PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    (PICTURES / "benchmark.png").write_bytes(benchmark_picture(study))
    if study.scaling:
        (PICTURES / "benchmark-scaling.png").write_bytes(scaling_picture(study.scaling))


if __name__ == "__main__":
    main()
