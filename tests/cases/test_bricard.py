"""Bricard's mechanism of the hard case b4: its mobility, and its motion with every joint cut."""

import numpy as np
import pytest

import mbd
from mbd.hardcases.redundant_rows import bricard
from mbd.integrators import Integrator
from tests.cases.schemes import name_of
from tests.problems import case

B4 = case("b4-iftomm-a04-bricard")
MODEL, START = bricard()
PLACES = B4["P3"]


def test_it_has_one_degree_of_freedom_where_grubler_counts_none() -> None:
    found = mbd.mobility(MODEL, START)
    assert (found.dof, found.grubler) == (B4["number of degrees of freedom"].value, 0)
    assert (found.coordinates, found.rank) == (5, 4), "the reference's own rank analysis: 5 unknowns, rank 4"
    (row,) = found.dependent
    assert "'P3'" in row.row and all("'P3'" in title for title, _ in row.on)
    assert found.consistent and not found.singular
    assert "1 degree of freedom, where Grübler counts 0" in str(found)


@pytest.mark.parametrize("cut", [["P0"], ["P2"], ["P5"]], ids=str)
def test_the_freedom_does_not_depend_on_where_the_loop_is_cut(cut: list[str]) -> None:
    found = mbd.mobility(bricard(cut=cut)[0])
    assert (found.dof, found.grubler, len(found.dependent)) == (1, 0, 1)


@pytest.mark.parametrize(
    "scheme",
    [
        mbd.GeneralizedAlpha(0.9), mbd.HHT(0.1), mbd.Newmark(), mbd.GeneralizedAlpha(0.8, formulation="index3"),
        pytest.param(mbd.RungeKutta853(), marks=pytest.mark.slow), pytest.param(mbd.RadauIIA(), marks=pytest.mark.slow),
    ],
    ids=name_of,
)  # fmt: skip
def test_with_every_joint_cut_its_bodies_float_and_move_as_they_must(scheme: Integrator) -> None:
    """No configuration on the way is singular, although thin rods have no inertia about their own axes."""
    model, start = bricard(cut="all")
    assert len(start.v) == 30 and len(start.q) == 35
    run = mbd.simulate(model, start, scheme, dt=1e-3, until=1.0)
    assert np.linalg.norm(run.at(1.0)["rod 2.tip"] - PLACES.value[0]) < (2e-6 if scheme.order() == 2 else 1e-10)
    assert run.violation.length < 1e-12
    assert (run.stats["singular_steps"], run.stats["shortened"]) == (0, 0)
