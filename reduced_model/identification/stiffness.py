"""Table II of the thesis: is that a spring, is it linear, and which modulus is it."""

from __future__ import annotations

import numpy as np

from fem_needle.identification import (
    Softening,
    StiffnessMatrix,
    beam_foundation_modulus,
    beam_modulus_of_point,
    identify_softening,
    indented_modulus,
    rod_modulus_of_point,
)
from reduced_model.thesis_data import NEEDLE_DIAMETER, TABLE_II, TISSUE_REPETITIONS, TissueTest
from reduced_model.validation.section import Section, blocks, prose, table

STIFFNESS = 520.0  # N/m: k_zz at 1.5 N, from which the thesis takes 0.52 kN/m^2
BENDING = 0.0256  # N m^2, Table III
LENGTH = 0.2  # m
RADII = (1e-3, 5e-3)  # m; the thesis does not say how large its tool is


def matrix(row: TissueTest) -> StiffnessMatrix:
    """Return the matrix of a column of Table II [N/m]."""
    return StiffnessMatrix(1e3 * np.array([[row.k_xx, row.k_xz], [row.k_zx, row.k_zz]]))


def softening() -> Softening:
    """Return how k_zz depends on the force, the columns weighted by their deviations."""
    columns = [(row.force, 1e3 * row.k_zz, 1e3 * row.deviation_zz) for row in TABLE_II]
    return identify_softening(*np.array(columns).T)


def curl_errors(row: TissueTest) -> float:
    """Return the curl over its standard error, if the entries varied independently from place to place."""
    error = np.hypot(row.deviation_xz, row.deviation_zx) / np.sqrt(TISSUE_REPETITIONS)
    return float(abs(row.k_xz - row.k_zx) / error)


def section() -> Section:
    """Return the section on the matrix."""
    header = ["force [N]", "symmetric part xx, zz, xz [N/mm]", "antisymmetric [N/mm]", "curl / k_zz [%]", "curl / standard error"]
    return Section(
        "2 The stiffness of the tissue",
        blocks(
            prose(f"""Means of Table II, {TISSUE_REPETITIONS} places each, taken apart. The standard error of the curl supposes
                that both entries vary independently between places; the thesis does not print more."""),
            table(header, [_cells(row) for row in TABLE_II]),
            "\n".join(f"- {prose(line)}" for line in _findings()),
        ),
    )


def meanings() -> tuple[tuple[str, float], ...]:
    """Return what the thesis' point stiffness is as a foundation modulus [N/m^2], by what it was measured with."""
    small, large = (beam_foundation_modulus(indented_modulus(STIFFNESS, a), NEEDLE_DIAMETER, BENDING) for a in RADII)
    return (
        ("taken as it stands, as if measured with a rigid rod of 1 m", rod_modulus_of_point(STIFFNESS, 1.0)),
        ("a rigid rod, 100 mm in tissue, moved sideways", rod_modulus_of_point(STIFFNESS, 0.1)),
        ("the free end of a long needle", beam_modulus_of_point(STIFFNESS, BENDING, "end")),
        ("the middle of a long needle", beam_modulus_of_point(STIFFNESS, BENDING, "middle")),
        (f"an indenter of {1e3 * RADII[0]:g} mm radius, then the needle lying on such tissue", small),
        (f"an indenter of {1e3 * RADII[1]:g} mm radius, then the needle lying on such tissue", large),
    )


def meaning_section() -> Section:
    """Return the section on what a point stiffness says."""
    found = meanings()
    rows = [[name, f"{1e-3 * modulus:.2g}"] for name, modulus in found]
    low, high = min(modulus for _, modulus in found[1:]), max(modulus for _, modulus in found[1:])
    text = blocks(
        prose(f"""k_zz = {1e-3 * STIFFNESS:g} N/mm at 1.5 N is a force per displacement of one point. The model needs a force
            per length and displacement. Formulas: [identification](identification.md), "What a point stiffness says"."""),
        table(["if it was measured with", "it means k [kN/m^2]"], rows),
        prose(f"""The same number means {1e-3 * low:.1f} to {1e-3 * high:.0f} kN/m^2, {low / found[0][1]:.0f} to
            {high / found[0][1]:.0f} times the {1e-3 * found[0][1]:g} kN/m^2 of the thesis, and the thesis does not print
            what would decide: the radius of its tool. Shipped scenes keep its number and say where it comes from."""),
    )
    return Section("3 What a point stiffness says of a foundation modulus", text)


def _cells(row: TissueTest) -> list[str]:
    found = matrix(row)
    symmetric = 1e-3 * found.symmetric
    return [
        f"{row.force:g}",
        f"{symmetric[0, 0]:.2f}, {symmetric[1, 1]:.2f}, {symmetric[0, 1]:.3f}",
        f"{1e-3 * found.antisymmetric[0, 1]:.3f}",
        f"{100 * found.relative_curl:.1f}",
        f"{curl_errors(row):.1f}",
    ]


def _findings() -> tuple[str, ...]:
    soft = softening()
    low, high = soft.exponent.interval()
    first, last = TABLE_II[0], TABLE_II[-1]
    curls = [100 * matrix(row).relative_curl for row in TABLE_II]
    return (
        f"""A spring's matrix is symmetric. The curl is {min(curls):.0f} to {max(curls):.0f} % of k_zz and
        {min(map(curl_errors, TABLE_II)):.0f} to {max(map(curl_errors, TABLE_II)):.0f} of its standard errors: not
        small. Carried once around a circle of 1 mm radius at 1.5 N the tool puts
        {1e6 * abs(matrix(last).closed_path_work(np.pi * 1e-6)):.0f} uJ into the tissue or takes them out, beside the
        {1e6 * 0.5e-6 * STIFFNESS:.0f} uJ that a spring of k_zz stores.""",
        f"""It {soft.verdict}: k_zz goes with the force to the power {soft.exponent.value:.1f} (95 %: {low:.1f} to
        {high:.1f}). With it a small change of force meets a tangent stiffness of {100 * soft.tangent_share:.0f} % of
        k_zz. The indentation grows from {first.force / first.k_zz:.1f} to {last.force / last.k_zz:.1f} mm: no small
        displacement about an equilibrium.""",
        f"""Homogeneous isotropic tissue has k_xx = k_zz; here their ratio is {first.k_xx / first.k_zz:.2f} at
        {first.force:g} N and {last.k_xx / last.k_zz:.2f} at {last.force:g} N. One of the two is not the tissue.""",
    )
