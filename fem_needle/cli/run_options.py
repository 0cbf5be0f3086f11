"""Options that commands share which leave a run folder, and the settings of a scene that they mean."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

RUNS = Path("runs")

Text = str | None

Out = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Run folder; by default runs/<name>, then runs/<name>-2, ...")
]
Force = Annotated[bool, typer.Option("--force", help="Replace the run in DIR.")]
Model = Annotated[Text, typer.Option("--model", metavar="KIND", help="fem, assumed-modes or another installed model.")]
Modes = Annotated[Text, typer.Option("--modes", metavar="N", help="How many assumed modes.")]
Variant = Annotated[
    Text, typer.Option("--variant", metavar="NAME", help="Of the assumed modes: conservative, corrected or as-printed.")
]
Basis = Annotated[
    Text, typer.Option("--basis", metavar="NAME", help="Assumed modes of the full-length or of the inserted-length.")
]
Corrections = Annotated[
    bool, typer.Option("--static-corrections", help="Let the static responses to loads join the assumed modes.")
]
Elements = Annotated[Text, typer.Option("--elements", metavar="N", help="Elements over the part that bends, or auto.")]
TimeStep = Annotated[
    Text, typer.Option("--time-step", metavar="TIME", help="Largest time step, such as 1e-3 or '1 ms', or auto.")
]
Tolerance = Annotated[Text, typer.Option("--tolerance", metavar="X", help="Tip error / largest tip deflection to aim at.")]
Analysis = Annotated[Text, typer.Option("--analysis", metavar="KIND", help="auto, dynamic, quasi-static or static.")]
OutputStep = Annotated[Text, typer.Option("--output-step", metavar="TIME", help="Time between samples, or auto.")]
Assignments = Annotated[
    list[str] | None, typer.Option("--set", metavar="PATH=VALUE", help="Change a value of the scene; may be repeated.")
]
NoVtk = Annotated[bool, typer.Option("--no-vtk", help="Write no frames for ParaView.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print summary.json and nothing else.")]
Explain = Annotated[bool, typer.Option("--explain", help="Say what each row of the table means.")]

_TABLES = {
    "model": "model.kind",
    "modes": "model.modes",
    "variant": "model.variant",
    "basis": "model.basis",
    "static_corrections": "model.static_corrections",
}


def by_path(**options: Any) -> dict[str, Any]:
    """Return options by their path in a scene, ``numerics.<name>`` but for those of the model; None: not given.

    A switch that is off says nothing.
    """
    found = {_TABLES.get(name, f"numerics.{name}"): value for name, value in options.items()}
    return {path: None if value is False else value for path, value in found.items()}
