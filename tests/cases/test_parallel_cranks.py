"""Case j2: three equal cranks on one coupler; the motion is unique, the forces of the pins are not."""

from __future__ import annotations

import pytest

import mbd
from mbd.hardcases import redundant_rows
from tests.cases.linkages import parallel_cranks
from tests.problems import case

J2 = case("j2-parallel-fourbar-redundant")
MODEL, START = redundant_rows.parallel_cranks()


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
