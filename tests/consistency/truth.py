"""True tips of random scenes by the slow reference solvers, refined until two truths agree."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from tests.consistency.random_scenes import OUTPUTS
from tests.references import piecewise_motion, pushed_motion
from tests.references.gauss import GAUSS, RADAU
from tests.references.piecewise_motion import Insertion, Motor
from tests.references.push import Push

SHARE = 0.3  # of the difference of two truths that agree: what the finer one may miss
CAUTION = 3.0  # the same of two that do not yet: seed 208 missed 2.4 times the difference
DEGREES = (8, 10, 12, 14, 16, 18)
SLOWEST, PER_PERIOD, PER_OUTPUT = 400.0, 6.0, 4.0  # steps of the coarsest truth: per second, per longest period, per output
MOST_STEPS = {"force": 1000, "other": 4000}  # of a truth beyond the second: what is dearer stays unknown


@dataclass(frozen=True)
class Truth:
    """Rows (tips [m] and, of a push, depths [m]) at the outputs, and what the rows may miss relative to their largest values."""

    rows: np.ndarray
    doubt: float

    def error(self, run):
        """Return the largest error of a run's tip, and of the depth of a push, relative to the largest values."""
        rows = np.array([run.tip_deflection, run.depth])[: len(self.rows)]
        time = np.linspace(0.0, run.scene.duration, OUTPUTS + 1)
        place = np.rint(run.time / run.scene.duration * OUTPUTS).astype(int)
        shown = np.abs(time[place] - run.time) < 1e-9 * run.scene.duration  # a run that ends early shows its end
        return _difference(rows[:, shown], self.rows[:, place[shown]], self.rows)


def _difference(rows, others, scale):
    return float(np.max(np.max(np.abs(rows - others), axis=1) / np.max(np.abs(scale), axis=1)))


def true_rows(scene, wanted):
    """Return the truth of a scene, refined until it is known to ``wanted`` or becomes too dear."""
    time, found = np.linspace(0.0, scene.duration, OUTPUTS + 1), []
    damped = any(layer.damping for layer in scene.tissue.layers)
    coarsest, most = _coarsest(scene), MOST_STEPS["force" if scene.insertion.kind == "force" else "other"]
    for level, degree in enumerate(DEGREES):
        steps = coarsest * 2.0**level
        if level > 1 and steps * scene.duration > most:
            break
        method = RADAU if damped and level % 2 else GAUSS  # two methods that agree do not both overlook a vibration
        found.append(_rows(scene, time, degree, steps, method))
        if level and SHARE * _difference(found[-2], found[-1], found[-1]) < wanted:
            break
    difference = _difference(found[-2], found[-1], found[-1])
    return Truth(found[-1], (SHARE if SHARE * difference < wanted else CAUTION) * difference)


def _rows(scene, time, degree, steps, method):
    if scene.insertion.kind == "force":
        found = pushed_motion(scene, time, degree, steps, method)
        return np.array([found.tip_deflection, found.depth])
    return piecewise_motion(scene, time, degree, steps, method)[None]


def _coarsest(scene):
    """Steps per second of the coarsest truth: a few per period of the slowest vibration at the start."""
    if scene.insertion.kind == "force":
        motor, depth = Push(scene, DEGREES[0], GAUSS).motor, scene.insertion.initial_depth
    else:
        motor = Motor(scene, Insertion(scene, np.array([0.0, scene.duration]), DEGREES[0]).breaks(0.0), DEGREES[0])
        depth = float(motor.loading.law.depth(0.0))
    at = motor.stages(np.zeros(1), np.array([depth]), np.zeros(1))
    square = eigh(-0.5 * (at.state[0] + at.state[0].T), at.mass[0], eigvals_only=True, subset_by_index=[0, 0])[0]
    frequency = np.sqrt(max(square, 0.0)) / (2.0 * np.pi)
    return max(SLOWEST, PER_OUTPUT * OUTPUTS / scene.duration, PER_PERIOD * frequency)
