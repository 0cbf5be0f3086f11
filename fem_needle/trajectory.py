"""The result of a run: arrays over time, SI, with the scene and what was computed how."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import scipy  # its parts are loaded where they are used
from numpy.typing import NDArray

from fem_needle.display import Card, Shown, in_millimeters, in_newtons, without_rounding
from fem_needle.limits import stations_on
from fem_needle.motion import wanted_radius
from fem_needle.plant import Plant
from fem_needle.sample_arrays import PATH, Samples
from fem_needle.scene import Scene, as_function
from fem_needle.section_forces import SectionForces, differentiated, section_forces
from fem_needle.time_integrals import twice_integrated

Array = NDArray[np.float64]

# Variables of `series.nc` over time: unit and meaning. The order is that of the file.
VARIABLES: dict[str, tuple[str, str]] = {
    "depth": ("m", "inserted length"),
    "speed": ("m/s", "insertion speed, positive going in"),
    "tip_deflection": ("m", "lateral displacement of the tip"),
    "tip_angle": ("rad", "slope of the needle at the tip"),
    "hub_angle": ("rad", "angle of the hub"),
    "push_force": ("N", "axial force that the insertion needs, positive going in"),
    "friction_force": ("N", "axial force of the shaft on the tissue, with the sign of the speed; at rest what holds a push"),
    "cutting_force": ("N", "axial force that cutting takes while the tip advances at its deepest"),
    "axial_force": ("N", "axial force A of the bent needle's tissue and supports, positive going in"),
    "tip_force": ("N", "lateral force of the loads at the tip"),
    "tissue_force": ("N", "total lateral force of the tissue on the needle"),
    "hub_force": ("N", "lateral force of the clamp on the needle"),
    "hub_moment": ("N m", "moment of the clamp on the needle"),
    "kinetic_energy": ("J", "lateral kinetic energy"),
    "bending_energy": ("J", "bending energy"),
    "tissue_energy": ("J", "energy of tissue and guide springs"),
    "guide_energy": ("J", "energy of the guide springs alone, a part of tissue_energy"),
    "load_work": ("J", "work of tip and lateral forces since the start"),
    "hub_work": ("J", "work of the moving hub since the start"),
    "tissue_work": ("J", "work of the swelling tissue since the start"),
    "tissue_dissipation": ("J", "energy lost in the tissue's viscosity since the start"),
    "boundary_energy": ("J", "-integral of the axial force A times speed since the start"),
    "energy_residual": ("J", "lateral energy minus its start value and all lateral works"),
    "push_work": ("J", "work of the push since the start"),
    "friction_dissipation": ("J", "energy lost in shaft friction since the start"),
    "cutting_work": ("J", "work spent on cutting since the start"),
    "arrest_loss": ("J", "axial energy lost where a membrane stopped the needle, since the start"),
    "axial_energy_residual": ("J", "axial energy minus its start value and all axial works"),
    "axial_kinetic_energy": ("J", "kinetic energy of the insertion"),
}

LATER_VARIABLES = ("cutting_force", "axial_force", "tip_force")  # that older files do not have
SAME_STATION = 1e-6  # of the length
ENERGY_BOUND = 0.01  # of the largest energy: a ledger that misses more says that the answer is not to be trusted
_RATIOS = ("error_estimate", "relative_energy_residual")

_FROM_SAMPLES = tuple(
    name
    for name in VARIABLES
    if name not in {"tip_deflection", "tip_angle", "hub_angle", "energy_residual", "axial_energy_residual"}
)


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Shown):
    """A run, sample by sample.

    Every variable of `VARIABLES` is an attribute, shape (nt,), e.g. ``run.tip_deflection``.

    Attributes
    ----------
    scene
        The scene that was run.
    time
        Times of the samples [s], shape (nt,).
    series
        The variables by name.
    guide_force
        Force of each guide on the needle [N], shape (nt, guides).
    arc_length
        Stations from the hub, 0, to the tip, l [m], shape (n,).
    station_deflection
        Deflection at the stations [m], shape (nt, n).
    lateral_force
        Each lateral load [N], as commanded in a loop, shape (nt, loads).
    path_position, path_deflection
        Where the tip has cut: y [m] and rest line r [m] at the end of the run, shape (points,); empty without a cut path.
    path_cubics
        Powers of the pieces between these points (`fem_needle.sample_arrays.Samples`); empty where they are unknown.
    signals
        Commands and measurements of a loop, ``command_<input>`` and ``measurement_<reading>``, shape (nt,) or, of several
        stations, (nt, n); nan where there was none yet; empty without a loop.
    summary
        What ``summary.json`` holds.
    plant, samples
        The model and its state at each sample; None in a run that was loaded.
    stored_sections
        Bending moment and shear force of a run that was loaded.
    course
        In which steps it was taken (`fem_needle.run_job.Course`); None of a loop or a run that was loaded.
    """

    scene: Scene
    time: Array
    series: dict[str, Array]
    guide_force: Array
    arc_length: Array
    station_deflection: Array
    lateral_force: Array = field(default_factory=lambda: np.zeros((0, 0)))
    path_position: Array = field(default_factory=lambda: np.zeros(0))
    path_deflection: Array = field(default_factory=lambda: np.zeros(0))
    path_cubics: Array = field(default_factory=lambda: np.zeros((0, 4)))
    signals: dict[str, Array] = field(default_factory=dict)
    summary: dict[str, Any] = field(default_factory=dict)
    plant: Plant | None = None
    samples: Samples | None = None
    stored_sections: SectionForces | None = None
    course: Any = None

    def __getattr__(self, name: str) -> Array:
        if name in VARIABLES and "series" in self.__dict__:
            return self.series[name]
        if name in self.__dict__.get("signals", ()):
            return self.signals[name]
        known = ", ".join([*VARIABLES, *self.__dict__.get("signals", ())])
        raise AttributeError(f"a trajectory has no {name!r}; its variables are {known}")

    def _card(self) -> Card:
        summary, model = self.summary, str(self.summary.get("model", self.scene.model.kind))
        largest = float(np.max(np.abs(self.tip_deflection)))
        ending = summary.get("stop_reason", "end")
        facts = [
            ("depth", f"{in_millimeters(float(self.depth[-1]))} at {self.time[-1]:.4g} s ({ending})"),
            ("tip", in_millimeters(without_rounding(float(self.tip_deflection[-1]), largest))),
            ("push", in_newtons(float(self.push_force[-1]))),
            ("analysis", f"{summary.get('analysis', 'unknown')}"),
            ("model", model),
            ("samples", str(len(self.time))),
            ("largest tip", in_millimeters(largest)),
            *((name.replace("_", " "), f"{summary[name]:.1e}") for name in _RATIOS if summary.get(name) is not None),
            *(("signal", name) for name in self.signals),
        ]
        if "target_error" in summary:
            facts.insert(1, ("target error", in_millimeters(summary["target_error"])))
        return Card("Trajectory", self.scene.title, tuple(facts))

    def deflection(self, arc_length: Array | None = None, derivative: int = 0) -> Array:
        """Return the deflection [m], or a derivative by arc length, at stations, shape (nt, n).

        Without stations: at those of the run. From the model itself, or, in a loaded run, by a cubic spline through the
        stored stations of the part that bends.
        """
        if arc_length is None and derivative == 0:
            return self.station_deflection
        stations = self.arc_length if arc_length is None else stations_on(arc_length, self.scene.needle.length)
        if self.plant is None or self.samples is None:
            return np.stack([self._from_stations(row, stations, derivative) for row in range(len(self.time))])
        return self.plant.deflection(self.samples.coordinates, self.samples.point_forces, self.depth, stations, derivative)

    @property
    def coordinates(self) -> Array | None:
        """Coordinates of the model at each sample, shape (nt, n); None in a run that was loaded."""
        return None if self.samples is None else self.samples.coordinates

    @property
    def point_forces(self) -> Array | None:
        """Forces on guides, at lateral loads and at the tip [N], shape (nt, p); None in a run that was loaded."""
        return None if self.samples is None else self.samples.point_forces

    @cached_property
    def section_forces(self) -> SectionForces:
        """Bending moment [N m] and shear force [N] at the stations of the run, shape (nt, n) each.

        Of a run that was loaded and whose file has none, from a spline through its stations: the shear force is rough.
        """
        if self.stored_sections is not None:
            return self.stored_sections
        if self.plant is not None and self.samples is not None:
            return section_forces(self.plant, self.samples, self.arc_length)
        return differentiated(self.scene, lambda derivative: self.deflection(derivative=derivative))

    @property
    def bending_moment(self) -> Array:
        """EI w'' [N m] at the stations, shape (nt, n)."""
        return self.section_forces.bending_moment

    @property
    def shear_force(self) -> Array:
        """EI w''' [N] at the stations, shape (nt, n); a tip force F gives -F at the tip."""
        return self.section_forces.shear_force

    @property
    def curvature(self) -> Array:
        """The moment over the bending stiffness [1/m] at the stations, shape (nt, n)."""
        return self.bending_moment / self.scene.needle.bending_stiffness

    @property
    def bending_stress(self) -> Array | None:
        """Largest stress of a section [Pa], E r times the curvature, shape (nt, n); None where the scene gives no section."""
        needle = self.scene.needle
        if needle.outer_diameter is None or needle.youngs_modulus is None:
            return None
        return 0.5 * needle.youngs_modulus * needle.outer_diameter * self.curvature

    def _from_stations(self, row: int, stations: Array, derivative: int) -> Array:
        values, start = self.station_deflection[row], -np.inf
        if self.scene.support.kind == "entry":
            start = self.scene.needle.length - float(self.depth[row])
        # A station next to the surface would add nothing but round-off.
        bent = self.arc_length > start + SAME_STATION * self.scene.needle.length
        if np.count_nonzero(bent) < 2:
            return np.zeros(stations.shape)
        knots, known = self.arc_length[bent], values[bent]
        clamp: Any = "not-a-knot"
        if np.isfinite(start):
            knots, known, clamp = np.append(start, knots), np.append(0.0, known), ((1, 0.0), (2, 0.0))
        return np.where(stations > start, scipy.interpolate.CubicSpline(knots, known, bc_type=clamp)(stations, derivative), 0.0)

    def save(self, folder: str | Path, *, force: bool = False) -> Path:
        """Write a run folder (docs/contract.md); refuse an existing one unless ``force``."""
        # The folder's room is above this one.
        from fem_needle.run_folder import save_run

        return save_run(self, Path(folder), force=force)

    @staticmethod
    def load(folder: str | Path) -> Trajectory:
        """Read a run folder."""
        from fem_needle.run_folder import load_run

        return load_run(Path(folder))


def trajectory_from_samples(
    plant: Plant, samples: Samples, summary: dict[str, Any], scene: Scene | None = None
) -> Trajectory:
    """Return the trajectory of all samples of a run, at least one.

    ``scene`` holds the run's settings where they differ from those of the plant's own scene.
    """
    scene, length = scene or plant.scene, plant.scene.needle.length
    stations = np.linspace(0.0, length, scene.numerics.output_points)
    state = (samples.coordinates, samples.point_forces, samples.depth)
    shapes = plant.deflection(*state, stations)
    series: dict[str, Array] = {name: getattr(samples, name) for name in _FROM_SAMPLES}
    series["tip_deflection"] = shapes[:, -1].copy()
    series["tip_angle"] = plant.deflection(*state, np.array([length]), 1)[:, 0]
    series["hub_angle"] = _hub_angles(plant, samples)
    energy = samples.lateral_energy
    gained = series["load_work"] + series["hub_work"] + series["tissue_work"] + series["boundary_energy"]
    series["energy_residual"] = energy - energy[0] - (gained - series["tissue_dissipation"])
    axial = series["axial_kinetic_energy"] - series["axial_kinetic_energy"][0]
    taken = series["friction_dissipation"] + series["cutting_work"] + series["boundary_energy"] + series["arrest_loss"]
    if scene.insertion.kind != "force":  # the push of a prescribed motion is what its balance needs
        series["push_work"] = axial + taken
    series["axial_energy_residual"] = axial + taken - series["push_work"]
    return Trajectory(
        scene=scene,
        time=samples.time,
        series={name: series[name] for name in VARIABLES},
        guide_force=samples.guide_force,
        arc_length=stations,
        station_deflection=shapes,
        lateral_force=samples.lateral_forces(len(scene.lateral_loads)),
        **{name: getattr(samples, name) for name in PATH},
        summary=summary,
        plant=plant,
        samples=samples,
    )


def _hub_angles(plant: Plant, samples: Samples) -> Array:
    """Return the hub's angle [rad]: of the bent needle, or under ``entry`` of a free hub that its torque alone turns."""
    support = plant.scene.support
    if support.kind == "hub":
        return plant.deflection(samples.coordinates, samples.point_forces, samples.depth, np.zeros(1), 1)[:, 0]
    if support.hub_rotational_inertia is None:
        return np.zeros(len(samples))
    return twice_integrated(as_function(support.hub_torque), samples.time.tolist()) / support.hub_rotational_inertia


def energy_warnings(run: Trajectory) -> list[str]:
    """Return the warning of a run whose energies miss too much."""
    residual = float(summary_of(run)["relative_energy_residual"])
    if residual <= ENERGY_BOUND:
        return []
    return [
        f"energies miss by {residual:.2g} of the largest > {ENERGY_BOUND:g}: the time step does not resolve the motion, "
        f"or something snaps; try a smaller time_step{guide_advice(run.scene)}"
    ]


def guide_advice(scene: Scene) -> str:
    """Return what calms rigid guides, index-3 constraints, whose forces an undamped integrator may let swing."""
    is_rigid = any(guide.stiffness == "rigid" for guide in scene.support.guides)
    return "; spectral_radius = 0.8 calms rigid guides" if is_rigid and wanted_radius(scene) == 1.0 else ""


def summary_of(run: Trajectory) -> dict[str, Any]:
    """Return the figures that follow from the series alone."""
    energy = run.kinetic_energy + run.bending_energy + run.tissue_energy
    largest = float(np.max(np.abs(energy)))
    residual = float(np.max(np.abs(run.energy_residual)))
    return {
        "final_depth": float(run.depth[-1]),
        "final_tip_deflection": float(run.tip_deflection[-1]),
        "max_abs_tip_deflection": float(np.max(np.abs(run.tip_deflection))),
        "relative_energy_residual": residual / largest if largest else 0.0,
    }
