"""Every integrator has the order that it is designed for, and the document's table is what is measured."""

import re
from pathlib import Path

import pytest

from tests.stability import orders

DOCUMENT = Path(__file__).parents[2] / "docs" / "robustness.md"
ROWS = {name: (order, cells) for name, order, cells in orders.rows()}
QUICK = (
    "collocation, radius 1 (Gauss), elements, entry",
    "collocation, radius 0 (Radau), modes, entry",
    "commanded force, elements, hub",
)


@pytest.mark.parametrize("case", orders.CASES)
@pytest.mark.parametrize("name", QUICK)
def test_order(name, case):
    designed, cells = ROWS[name]
    give = cells[orders.CASES.index(case)]
    if give is None:
        return
    errors, counts = give()
    assert list(errors) == sorted(errors, reverse=True)
    assert orders.observed(errors, counts) == pytest.approx(designed, abs=0.2)


def written():
    """Cells of the document's table by the integrator's name."""
    section = DOCUMENT.read_text(encoding="utf-8").split("## Orders of the integrators")[1].split("\n## ")[0]
    lines = [line.strip() for line in section.splitlines() if line.startswith("| ")]
    lines = [[cell.strip() for cell in line.removeprefix("|").removesuffix("|").split("|")] for line in lines]
    return {cells[0]: cells[1:] for cells in lines if re.fullmatch(r"\d", cells[1])}


def test_the_document_names_every_integrator():
    assert list(written()) == list(ROWS)


@pytest.mark.slow
def test_the_document_has_the_measured_orders():
    found = {name: [str(order), *values] for name, order, values in orders.measured()}
    for name, cells in written().items():
        order, *values = found[name]
        assert cells[0] == order
        for cell, value in zip(cells[1:], values, strict=True):
            assert (cell == "") == (value is None), name
            if value is not None:
                assert float(cell) == pytest.approx(value, abs=0.1), name
                assert value > float(order) - 0.2, name
