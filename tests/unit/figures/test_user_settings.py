"""A user's own settings of matplotlib change neither the bytes nor the success of a picture."""

import os
import subprocess
import sys

import matplotlib as mpl
import numpy as np
import pytest

from fem_needle import analyze, converge, identify, load_scene, read_measurements, steer
from fem_needle.analysis.picture import analysis_picture
from fem_needle.benchmark.picture import benchmark_picture
from fem_needle.benchmark.record import read_record
from fem_needle.benchmark.scaling_picture import scaling_picture
from fem_needle.closed_loop.picture import steer_picture
from fem_needle.closed_loop.repeated_picture import repeated_picture
from fem_needle.closed_loop.repeating import repeat
from fem_needle.comparison.picture import comparison_picture
from fem_needle.comparison.study import compare
from fem_needle.convergence.picture import convergence_picture
from fem_needle.figures import courses, energies, shapes, tip_path, waterfall
from fem_needle.figures.animation import animated_gif
from fem_needle.identification.picture import identification_picture
from fem_needle.identification.sample_data import sample_path
from fem_needle.pictures import FORMATS, picture_bytes
from fem_needle.run_folder import save_run
from fem_needle.view import arrangement
from fem_needle.view.by_matplotlib import picture
from fem_needle.view.drawing import drawing
from reduced_model.validation.pictures import Curve, Panel, curve_picture
from tests.house.source import ROOT

HOSTILE = {
    "text.usetex": True,
    "font.family": "no such font",
    "font.size": 31.0,
    "axes.labelsize": "xx-large",
    "axes.facecolor": "black",
    "axes.unicode_minus": False,
    "axes.formatter.use_locale": True,
    "axes.xmargin": 0.4,
    "figure.dpi": 37,
    "figure.facecolor": "pink",
    "figure.constrained_layout.h_pad": 1.0,
    "savefig.bbox": "tight",
    "savefig.transparent": True,
    "savefig.facecolor": "green",
    "lines.linestyle": ":",
    "lines.antialiased": False,
    "legend.fontsize": 3,
    "legend.loc": "center",
    "image.cmap": "gray",
    "path.sketch": (3.0, 50.0, 5.0),
    "svg.fonttype": "path",
    "pdf.compression": 0,
    "xtick.bottom": False,
    "ytick.right": True,
    "mathtext.fontset": "stix",
    "patch.force_edgecolor": True,
}
LAYER = "tissue.layers.0.foundation_modulus"
SECONDS = np.array([0.0, 1.0, 2.0])
PICTURES = {
    "analyze": lambda made: analysis_picture(made("analyze")),
    "benchmark": lambda made: benchmark_picture(made("benchmark")),
    "scaling": lambda made: scaling_picture(made("benchmark").scaling),
    "steer": lambda made: steer_picture(made("steer")),
    "repeat": lambda made: repeated_picture(made("repeat")),
    "compare": lambda made: comparison_picture(made("compare")),
    "converge": lambda made: convergence_picture(made("converge")),
    "identify": lambda made: identification_picture(made("identify")),
    "animation": lambda made: animated_gif(made("steer")),
    "view": lambda made: picture(drawing(arrangement(made("steer")), 1)),
    "validate": lambda made: curve_picture("a", [Panel("b", "c", (Curve("d", SECONDS, SECONDS),))]),
    **{
        f"{figure.__name__}.{kind}": lambda made, figure=figure, kind=kind: picture_bytes(figure(made("steer")), kind)
        for figure in (shapes, tip_path, courses, energies, waterfall)
        for kind in FORMATS
    },
}


def short():
    return load_scene("steering").with_values({"numerics.output_step": 0.5, "numerics.elements": 2, "numerics.time_step": 0.05})


def fitted():
    scene = load_scene("brachytherapy").with_value("numerics.analysis", "static")
    return identify(scene, [LAYER], [read_measurements(sample_path("brachytherapy-tips"))])


MADE = {
    "analyze": lambda: analyze(load_scene("three-layers"), [0.05]),
    "benchmark": lambda: read_record(max(path for path in (ROOT / "benchmarks" / "results").glob("*.json"))),
    "steer": lambda: steer(short()),
    "repeat": lambda: repeat(short(), 2),
    "compare": lambda: compare(load_scene("bench-s"), modes=(1,)),
    "converge": lambda: converge(load_scene("bench-s"), "elements", [1, 2, 4]),
    "identify": fitted,
}


@pytest.fixture(scope="module")
def made():
    known = {}

    def of(name):
        if name not in known:
            known[name] = MADE[name]()
        return known[name]

    return of


@pytest.mark.filterwarnings("ignore::fem_needle.errors.SuspiciousValueWarning")
@pytest.mark.parametrize("draw", PICTURES.values(), ids=PICTURES)
def test_bytes_do_not_depend_on_settings(made, draw):
    usual = draw(made)
    with mpl.rc_context(HOSTILE):
        assert draw(made) == usual


def test_a_file_of_settings_and_an_unknown_backend(tmp_path, made):
    save_run(made("steer"), tmp_path / "run", vtk=False)
    settings = tmp_path / "matplotlibrc"
    settings.write_text("text.usetex: True\nfont.size: 31\nfont.family: none such\nno.such.key: 1\nsavefig.bbox: tight\n")
    written = []
    for environment in ({}, {"MATPLOTLIBRC": str(settings), "MPLBACKEND": "none"}):
        command = [sys.executable, "-m", "fem_needle", "plot", tmp_path / "run", "--kind", "shapes", "--force"]
        subprocess.run(command, env=os.environ | environment, cwd=ROOT, check=True, capture_output=True, timeout=100)
        written.append((tmp_path / "run" / "shapes.png").read_bytes())
    assert written[0] == written[1]
