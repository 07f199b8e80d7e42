"""Case j2: three equal cranks on one coupler; the motion is unique, the forces of the pins are not."""

from __future__ import annotations

import numpy as np
import pytest

import mbd
from mbd.integrators.family import NewmarkFamily
from tests.cases.linkages import parallel_cranks
from tests.cases.schemes import WITH_ROWS, name_of
from tests.helpers import assert_second_order
from tests.problems import case

J2 = case("j2-parallel-fourbar-redundant")
ANGLE, RATE = J2.start["theta_from_downward"], J2.start["thetadot"]
MODEL = parallel_cranks()
START = mbd.assemble(MODEL, {"base 0.angle": ANGLE, "pin 0.angle": -ANGLE}, {"base 0.rate": RATE})


def test_the_one_redundant_row_is_named_with_those_it_depends_on() -> None:
    found = mbd.mobility(MODEL, START)
    assert len(found.dependent) == J2["number of redundant constraint equations"].value
    assert (found.dof, found.grubler, found.consistent, found.singular) == (1, 0, True, False)
    (row,) = found.dependent
    assert row.row == "'pin 2' (y)"
    assert [title for title, _ in row.on] == ["'pin 1' (x)", "'pin 1' (y)", "'pin 2' (x)"]


@pytest.mark.parametrize("cut", ["auto", "all", ["base 1", "pin 2"], ["pin 0"]], ids=str)
def test_one_row_is_redundant_under_every_cut(cut: list[str] | str) -> None:
    found = mbd.mobility(parallel_cranks(cut=cut))
    assert (found.dof, found.grubler, len(found.dependent)) == (1, 0, 1)


@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_every_crank_beyond_the_second_adds_a_redundant_row(count: int) -> None:
    found = mbd.mobility(parallel_cranks(count))
    assert (found.dof, found.grubler, len(found.dependent)) == (1, 3 - count, count - 2)


@pytest.mark.parametrize("scheme", WITH_ROWS, ids=name_of)
def test_the_crank_angle_meets_the_reference_to_second_order(scheme: NewmarkFamily) -> None:
    reference = J2["crank angle"]

    def errors(dt: float) -> np.ndarray:
        run = mbd.simulate(MODEL, START, scheme, dt=dt, until=reference.t[-1])
        return run.at(reference.t)["base 0.angle"] - reference.value

    assert_second_order(errors, 4e-3, halvings=2)


@pytest.mark.parametrize("scheme", WITH_ROWS, ids=name_of)
def test_the_pins_carry_the_coupler_together_and_are_told_not_unique(scheme: NewmarkFamily) -> None:
    run = mbd.simulate(MODEL, START, scheme, dt=1e-3, until=1.0)
    total = sum(run[f"pin {k}.reaction_force"][0, :2] for k in range(3))
    assert total == pytest.approx(J2["sum of the joint forces"].value, abs=1e-9)
    assert np.max(np.abs(run.record.lam)) < 100.0, "no large multipliers of alternating sign"
    (note,) = run.stats["notes"]
    assert note.startswith("redundant constraints: 1 ('pin 2' (y) depends on 'pin 1' (x), 'pin 1' (y), 'pin 2' (x))")
    assert "multipliers are not" in note
