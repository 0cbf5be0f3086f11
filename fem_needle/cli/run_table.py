"""What `run` shows at the end: a short table in mm, N, s, and the explanation of its rows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fem_needle.checks import notes
from fem_needle.display import in_newtons, without_rounding

if TYPE_CHECKING:
    from fem_needle.trajectory import Trajectory

Row = tuple[str, str]

EXPLANATION = (
    ("depth", "inserted length z, from the tissue's surface to the tip, at the end of the run."),
    ("tip deflection", "sideways displacement of the tip from the straight axis, in the sense of a positive lateral force."),
    ("push force", "axial force that the insertion needs at the end, friction included; positive pushes in."),
    ("energy residual", "largest gap in the balance of lateral energy and works, each term computed for itself."),
    (
        "error estimate",
        "largest tip error over the run by the largest tip deflection: from finer time steps, finer elements and what was left "
        "out. --tolerance sets the aim.",
    ),
    (
        "analysis",
        "dynamic: with inertia; quasi-static: without; static: a series of equilibria. --analysis chooses, else the tolerance.",
    ),
    ("model", "--model, --modes, --variant, --basis and --static-corrections choose; elements: --elements, --degree, --mesh."),
    ("time step", "--time-step chooses, else the tolerance."),
    ("inertia", "parts of the run, how the needle got through each of them, and why."),
    ("left out", "terms of the equation of motion that do not matter here, each with its reason."),
    ("note", "what may surprise, and the key that changes it."),
    ("run folder", "scene.toml repeats the run; summary.json has this table in SI; series.nc everything over time."),
)


def run_rows(run: Trajectory, folder: Path, known_warnings: Sequence[str]) -> Iterator[Row]:
    """Yield name and value of every row; warnings that were shown before are left out."""
    summary = run.summary
    yield "depth", f"{1e3 * summary['final_depth']:.4g} mm at {run.time[-1]:.4g} s ({summary['stop_reason']})"
    tip, largest = 1e3 * summary["final_tip_deflection"], 1e3 * summary["max_abs_tip_deflection"]
    tip = without_rounding(tip, largest)
    yield "tip deflection", f"{tip:.4g} mm (largest {largest:.4g} mm)"
    yield "push force", in_newtons(float(run.push_force[-1]))
    yield "energy residual", f"{summary['relative_energy_residual']:.1e} of the largest lateral energy"
    yield from computation_rows(run, folder, known_warnings)


def computation_rows(run: Trajectory, folder: Path, known_warnings: Sequence[str]) -> Iterator[Row]:
    """Yield the rows that tell how a run was computed, how exactly, and where it is."""
    summary = run.summary
    yield "error estimate", _estimate(summary.get("error_estimate"), run.scene.numerics.tolerance)
    yield "analysis", str(summary["analysis"])
    yield "model", model_text(summary)
    yield "time step", f"{summary['steps']} steps of up to {summary['time_step']:.4g} s"
    yield from _part_rows(summary)
    for index, skipped in enumerate(summary.get("skipped", ())):
        yield "" if index else "left out", f"{skipped['term']}: {skipped['reason']}"
    for warning in summary.get("warnings", ()):
        if warning not in known_warnings:
            yield "warning", warning
    for note in notes(run.scene):
        yield "note", note
    yield "computed in", f"{summary['solve_time']:.2g} s"
    yield "run folder", str(folder)
    if (folder / "deflection.pvd").exists():
        yield "ParaView", f"open {folder / 'deflection.pvd'}, Apply, then Filters > Warp By Vector with 'deflection'"


def _part_rows(summary: Mapping[str, Any]) -> Iterator[Row]:
    """Yield how a run with inertia got through its parts, and why."""
    parts = summary.get("parts", ()) if summary["analysis"] == "dynamic" else ()
    for index, part in enumerate(parts):
        when = f"{part['begin']:.4g} to {part['end']:.4g} s: " if len(parts) > 1 else ""
        yield "" if index else "inertia", f"{when}{part['how']}; {part['reason']}"


def _estimate(estimate: float | None, tolerance: float) -> str:
    if estimate is None:
        return "none: no finer computation to compare with"
    return f"{estimate:.1e} of the largest tip deflection (tolerance {tolerance:.1e})"


def model_text(description: Mapping[str, Any]) -> str:
    """Return a model in words: kind, and elements or modes, variant and basis where it has any."""
    parts = [str(description.get("model", "?"))]
    if "elements" in description:
        degree = f" of degree {description['degree']}" if "degree" in description else ""
        parts.append(f"{description['elements']} elements{degree}")
    if "modes" in description:
        parts.append(f"{description['modes']} mode{'s' if description['modes'] != 1 else ''}")
    if description.get("static_corrections"):
        parts.append(f"{description['static_corrections']} static corrections")
    return ", ".join([*parts, *(f"{key} {description[key]}" for key in ("variant", "basis") if key in description)])
