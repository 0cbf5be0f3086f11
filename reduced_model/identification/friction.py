"""Table I of the thesis repeated: friction from a rising push, twenty times."""

from __future__ import annotations

from functools import cache

import numpy as np

from fem_needle import load_scene
from fem_needle.identification import FrictionRepetitions, Spread, repeat_friction_experiment
from fem_needle.identification.friction import CUTOFF
from fem_needle.identification.friction_experiment import NOISE
from reduced_model.thesis_data import FRICTION_REPETITIONS, TABLE_I
from reduced_model.validation.section import Section, blocks, prose, table

SCENE = "friction-ramp"
SEED = 1


@cache
def repetitions() -> FrictionRepetitions:
    """Return the simulated experiments: as many as in the thesis, friction scattered as in Table I."""
    deviations = TABLE_I.coulomb_deviation, TABLE_I.viscous_deviation
    return repeat_friction_experiment(load_scene(SCENE), FRICTION_REPETITIONS, deviations=deviations, seed=SEED)


def section() -> Section:
    """Return the section."""
    found = repetitions()
    header = ["", "mean", "its 95 % interval", "standard deviation", "its 95 % interval", "thesis: mean", "standard deviation"]
    rows = [
        _row("mu_s [N]", found.coulomb, TABLE_I.coulomb, TABLE_I.coulomb_deviation),
        _row("mu_v [N s/m]", found.viscous, TABLE_I.viscous, TABLE_I.viscous_deviation),
    ]
    about = prose(f"""The scene `{SCENE}`: the tip has left the tissue, so that nothing is cut, and the push rises until the
        needle slides {1e3 * _slid():.0f} mm. {FRICTION_REPETITIONS} repetitions with friction drawn about {TABLE_I.coulomb:g} N
        and {TABLE_I.viscous:g} N s/m with the deviations of Table I; noise of {1e6 * NOISE["depth"]:g} um on the depth
        and {1e3 * NOISE["push_force"]:g} mN on the force; filtered at {CUTOFF:g} Hz.""")
    return Section("1 Friction", blocks(about, table(header, rows), _findings(found)))


def _slid() -> float:
    insertion = load_scene(SCENE).insertion
    return float(insertion.final_depth or 0.0) - insertion.first_depth


def _row(name: str, found: Spread, mean: float, deviation: float) -> list[str]:
    low, high = found.mean.interval()
    small, large = found.deviation_interval()
    return [
        name,
        f"{found.mean.value:.3f}",
        f"{low:.3f} to {high:.3f}",
        f"{found.deviation:.3f}",
        f"{small:.3f} to {large:.3f}",
        f"{mean:g}",
        f"{deviation:g}",
    ]


def _findings(found: FrictionRepetitions) -> str:
    errors = np.sqrt(np.mean(found.errors**2, axis=0))
    stated = np.sqrt(np.mean([fit.fit.standard_errors**2 for fit in found.fits], axis=0))
    held = [_held(found, index) for index in (0, 1)]
    below = [fit.break_away[0] - true for fit, true in zip(found.fits, found.true[:, 0], strict=True) if fit.break_away]
    lines = (
        f"""One experiment errs by {1e3 * errors[0]:.1f} mN and {errors[1]:.3f} N s/m (root mean square), and says so: its
        own standard errors are {1e3 * stated[0]:.1f} mN and {stated[1]:.3f} N s/m, and the 95 % intervals hold the
        truth in {held[0]} and {held[1]} of {len(found.fits)}. The spread of Table I is several times that: with such
        sensors it is the friction that differs, not the estimate.""",
        f"""The push at the last sample that sticks is {-1e3 * float(np.mean(below)):.0f} mN below mu_s in the mean: the
        filter blends 50 ms on either side of the moment when the needle breaks away. It is a bound; the regression
        over the sliding samples is the estimate.""",
    )
    return "\n".join(f"- {prose(line)}" for line in lines)


def _held(found: FrictionRepetitions, index: int) -> int:
    ends = np.array([fit.fit.intervals()[index] for fit in found.fits])
    return int(np.sum((ends[:, 0] < found.true[:, index]) & (found.true[:, index] < ends[:, 1])))
