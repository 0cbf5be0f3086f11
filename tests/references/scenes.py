"""What the reference solvers read from a scene: depth, loads and layers as functions of time."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from fem_needle.scene import Table
from fem_needle.scene.time_functions import as_function

_SAMPLES = 2001  # per smooth stretch, to find where the tip passes a border


@dataclass(frozen=True)
class Motion:
    """Result of a reference: time (nt,) [s], depth (nt,) [m], tip (nt,) [m], its rate (nt,) [m/s], energy (nt,) [J].

    ``deflection(arc_length)`` gives the deflection [m] of shape (nt, n); coordinates and rates are those of the method.
    """

    time: np.ndarray
    depth: np.ndarray
    tip_deflection: np.ndarray
    tip_velocity: np.ndarray
    energy: np.ndarray
    deflection: object
    coordinates: np.ndarray
    rates: np.ndarray


class DepthLaw:
    """z(t) and v(t) of a scene's insertion, and where they have kinks."""

    def __init__(self, insertion):
        self.insertion = insertion
        moving = {"hold": 0.0, "speed": insertion.speed, "profile": insertion.depth}[insertion.kind]
        self.law = as_function(moving)
        self.rest = np.inf
        if insertion.kind == "speed" and insertion.final_depth is not None:
            self.rest = (insertion.final_depth - insertion.initial_depth) / insertion.speed

    def depth(self, time):
        time = np.asarray(time, dtype=float)
        if self.insertion.kind == "profile":
            return self.law.value(time)
        return self.insertion.initial_depth + self.law.integral(np.minimum(time, self.rest))

    def speed(self, time):
        time = np.asarray(time, dtype=float)
        if self.insertion.kind == "profile":
            return self.law.derivative(time)
        return np.where(time < self.rest, self.law.value(time), 0.0)

    def kinks(self):
        return [*self.law.breakpoints, *([self.rest] if np.isfinite(self.rest) else [])]

    def passes(self, borders, duration):
        """Times at which the tip passes one of the borders [m]."""
        corners = np.unique([0.0, duration, *(t for t in self.kinks() if 0.0 < t < duration)])
        found = []
        for a, b in pairwise(corners):
            t = np.linspace(a, b, _SAMPLES)
            for border in borders:
                gap = self.depth(t) - border
                for i in np.flatnonzero(gap[:-1] * gap[1:] < 0.0):
                    found.append(brentq(lambda x, y=border: float(self.depth(x)) - y, t[i], t[i + 1], xtol=1e-15))
                found += list(t[gap == 0.0][:1])
        return found


class Loading:
    """Loads, layers and times of kinks of a scene."""

    def __init__(self, scene):
        self.scene = scene
        self.law = DepthLaw(scene.insertion)
        self.factor = as_function(scene.tissue.stiffness_factor)
        self.layers = scene.tissue.layers
        self.laterals = [load for load in scene.loads if load.kind == "lateral"]

    def layer_modulus(self, y):
        """k [N/m^2] of the layer at y, the deeper one at a border."""
        y = np.asarray(y, dtype=float)
        inside = [(layer.start <= y) & (y < layer.far_side) for layer in self.layers]
        return sum((where * layer.foundation_modulus for where, layer in zip(inside, self.layers, strict=True)), 0.0 * y)

    def layer_damping(self, y):
        """c [N s/m^2] of the layer at y."""
        y = np.asarray(y, dtype=float)
        inside = [(layer.start <= y) & (y < layer.far_side) for layer in self.layers]
        return sum((where * layer.damping for where, layer in zip(inside, self.layers, strict=True)), 0.0 * y)

    def tip_force(self, time, depth):
        total = np.zeros(np.shape(time))
        for load in self.scene.loads:
            if load.kind != "tip":
                continue
            turned = as_function(load.direction).value(time)
            if load.force is not None:
                total = total + turned * as_function(load.force).value(time)
            else:
                total = total + turned * load.bevel_coefficient * self.layer_modulus(depth) * self.factor.value(time)
        return total

    def kinks(self, duration):
        borders = [y for layer in self.layers for y in (layer.start, layer.far_side) if np.isfinite(y)]
        varying = [self.scene.tissue.stiffness_factor, self.scene.support.hub_deflection, self.scene.support.hub_angle]
        varying += [load.force for load in self.scene.loads] + [load.direction for load in self.scene.loads if load.kind == "tip"]
        tables = [t for value in varying if isinstance(value, Table) for t in value.time]
        return [*self.law.kinks(), *tables, *self.law.passes(borders, duration)]
