"""Scenes for the tests of this folder, and hypothesis strategies that build any scene."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

from fem_needle.scene import Guide, Insertion, Layer, Needle, Scene, Support, TipLoad, Tissue


def hub_scene(**changes: Any) -> Scene:
    """A tube of 0.2 m from a hub, a guide at -30 mm, 20 to 160 mm deep."""
    parts: dict[str, Any] = {
        "needle": Needle(length=0.2, youngs_modulus=200e9, outer_diameter=1.27e-3, inner_diameter=1e-3, density=8e3),
        "support": Support(kind="hub", guides=[Guide(position=-0.03, stiffness="rigid")]),
        "tissue": Tissue(layers=[Layer(name="gel", start=0.0, foundation_modulus=520.0)]),
        "insertion": Insertion(kind="speed", initial_depth=0.02, speed=0.01, final_depth=0.16),
        "loads": [TipLoad(force=0.1)],
    }
    return Scene(**(parts | changes))


def entry_data(**changes: Any) -> dict[str, Any]:
    """Plain data of a scene with the support entry."""
    data: dict[str, Any] = {
        "needle": {"length": 0.2, "bending_stiffness": 0.0256, "mass_per_length": 0.01},
        "support": {"kind": "entry"},
        "tissue": {"layers": [{"foundation_modulus": 520.0}]},
        "insertion": {"kind": "hold", "initial_depth": 0.1},
        "run": {"duration": 1.0},
    }
    return data | changes


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_subnormal=False)


def tables(low: float, high: float) -> st.SearchStrategy[dict[str, Any]]:
    times = st.lists(numbers(-1e3, 1e3), min_size=2, max_size=5, unique=True).map(sorted)
    return times.flatmap(
        lambda time: st.fixed_dictionaries(
            {"time": st.just(time), "value": st.lists(numbers(low, high), min_size=len(time), max_size=len(time))}
        )
    )


def time_values(low: float, high: float) -> st.SearchStrategy[Any]:
    middle, half = (low + high) / 2.0, (high - low) / 4.0
    sinusoid = st.fixed_dictionaries(
        {"mean": numbers(middle - half, middle + half), "amplitude": numbers(-half, half)},
        optional={"phase": numbers(-7.0, 7.0)},
    ).flatmap(lambda wave: numbers(1e-3, 1e3).map(lambda frequency: wave | {"frequency": frequency}))
    return st.one_of(numbers(low, high), tables(low, high), sinusoid)


def needles() -> st.SearchStrategy[dict[str, Any]]:
    section = {"outer_diameter": numbers(4e-4, 3e-3)}
    return st.one_of(
        st.fixed_dictionaries(
            {"youngs_modulus": numbers(1e9, 1e12), "density": numbers(1.0, 2e4), **section},
            optional={"inner_diameter": numbers(0.0, 3.9e-4)},
        ),
        st.fixed_dictionaries({"bending_stiffness": numbers(1e-10, 1e6), "mass_per_length": numbers(1e-9, 1e3)}),
    ).flatmap(lambda needle: numbers(0.1, 100.0).map(lambda length: needle | {"length": length}))


def layers() -> st.SearchStrategy[list[dict[str, Any]]]:
    """Up to three layers that do not overlap, with and without gaps."""
    keys = {"foundation_modulus": numbers(0.0, 1e12)}
    options = {"damping": numbers(0.0, 1e6), "cutting_force": numbers(0.0, 10.0), "puncture_force": numbers(0.0, 10.0)}
    layer = st.fixed_dictionaries(keys, optional=options)
    borders = st.lists(numbers(0.0, 0.5), min_size=6, max_size=6, unique=True).map(sorted)
    return st.tuples(st.lists(layer, max_size=3), borders, st.lists(st.text(min_size=1), min_size=3, unique=True)).map(
        lambda drawn: [
            item | {"name": drawn[2][index], "start": drawn[1][2 * index], "end": drawn[1][2 * index + 1]}
            for index, item in enumerate(drawn[0])
        ]
    )


def insertions() -> st.SearchStrategy[dict[str, Any]]:
    start = numbers(0.0, 0.04)
    return st.one_of(
        st.fixed_dictionaries({"kind": st.just("hold"), "initial_depth": start}),
        st.fixed_dictionaries({"kind": st.just("profile"), "depth": time_values(0.0, 0.09)}),
        st.fixed_dictionaries(
            {"kind": st.just("force"), "initial_depth": start, "push_force": time_values(-10.0, 10.0)},
            optional={"final_depth": numbers(0.05, 0.09)},
        ),
        st.fixed_dictionaries(
            {"kind": st.just("speed"), "initial_depth": start, "speed": numbers(1e-6, 10.0), "final_depth": numbers(0.05, 0.09)}
        ),
    )


def scene_data() -> st.SearchStrategy[dict[str, Any]]:
    """Plain data of possible scenes of both supports."""
    tip = st.fixed_dictionaries({"kind": st.just("tip"), "force": time_values(-10.0, 10.0)})
    bevel = st.fixed_dictionaries({"kind": st.just("tip"), "bevel_coefficient": numbers(-1e-3, 1e-3)})
    lateral = st.fixed_dictionaries(
        {"kind": st.just("lateral"), "position": numbers(-0.009, 0.0), "force": time_values(-10.0, 10.0)}
    )
    hub = st.fixed_dictionaries(
        {"kind": st.just("hub")},
        optional={"hub_deflection": time_values(-0.1, 0.1), "hub_angle": time_values(-0.5, 0.5)},
    )
    free = st.fixed_dictionaries(
        {"kind": st.just("hub"), "hub_rotation": st.just("free"), "hub_rotational_inertia": numbers(1e-9, 1.0)},
        optional={"hub_torque": time_values(-1.0, 1.0)},
    )
    factor = {"stiffness_factor": time_values(0.0, 5.0)}
    tissue = st.one_of(
        st.fixed_dictionaries({"layers": layers()}, optional=factor),
        st.fixed_dictionaries({"kind": st.just("tip-spring"), "tip_stiffness": numbers(0.0, 1e6)}, optional=factor),
    )
    numerics = st.fixed_dictionaries(
        {},
        optional={
            "elements": st.one_of(st.just("auto"), st.integers(1, 1_000_000)),
            "time_step": st.one_of(st.just("auto"), numbers(1e-9, 1.0)),
            "analysis": st.sampled_from(["auto", "dynamic", "quasi-static"]),
            "degree": st.sampled_from([3, 4]),
        },
    )
    common = {
        "title": st.text(),
        "needle": needles(),
        "tissue": tissue,
        "insertion": insertions(),
        "run": st.fixed_dictionaries({"duration": numbers(1e-3, 1e3)}, optional={"seed": st.integers(0, 2**62)}),
        "numerics": numerics,
    }
    entry = st.just({"kind": "entry"})
    return st.one_of(
        st.fixed_dictionaries(
            common | {"support": st.one_of(hub, free), "loads": st.lists(st.one_of(tip, bevel, lateral), max_size=3)}
        ),
        st.fixed_dictionaries(common | {"support": entry, "loads": st.lists(st.one_of(tip, bevel), max_size=3)}),
    )
