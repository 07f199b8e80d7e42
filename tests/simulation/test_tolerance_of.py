"""What `tol_of` names is as accurate as `tol` asks for, at rows and between them; nothing else counts."""

from functools import cache

import numpy as np
import pytest

import mbd
from mbd.errors import ModelError, UnknownNameError
from mbd.hardcases.redundant_rows import bricard
from tests.equations.mechanisms import four_bar
from tests.mechanisms_between_rows import KINDS


def linkage():
    model = four_bar()
    return model, mbd.assemble(model)


def turning():
    """A pendulum, and beside it a fast wheel with a torque of forty teeth a turn, which nobody asks for."""
    model = mbd.Model("turning")
    rod = mbd.Link("rod", 1.0, 1.0, 0.5, 0.02)
    wheel = mbd.RigidBody("wheel", mass=1.0, inertia=0.01)
    spin = mbd.Revolute("spin", model.ground.point(1.0, 0.0), wheel.origin)
    model.connect(mbd.Revolute("hinge", model.ground.origin, rod.start), spin)
    model.apply(mbd.Potential("teeth", lambda angle: 0.02 * mbd.cos(40.0 * angle), arguments=("spin.angle",)))
    return model, mbd.assemble(model, {"hinge.angle": 1.0}, {"spin.angle": 15.0})


MAKERS = {
    "redundant": bricard, "linkage": linkage, "turning": turning,
    "driven": lambda: KINDS["tree"](1), "sliding": lambda: KINDS["standing"](0),
}  # fmt: skip
ASKED = {
    "redundant": ("P3.reaction_torque", "P1.angle"),
    "linkage": ("A.reaction_force", "D.reaction_force"),
    "turning": ("hinge.angle", "hinge.reaction_force"),
    "driven": ("rod.tension", "kinetic_energy"),
    "sliding": ("foot 0.force", "hinge.rate"),
}


@cache
def scene(name):
    model, start = MAKERS[name]()
    return model, start, mbd.simulate(model, start, mbd.RungeKutta853(), dt=1e-3, until=0.8)


@pytest.mark.covering
@pytest.mark.parametrize("name", MAKERS)
@pytest.mark.parametrize(
    ("scheme", "tols"),
    [(mbd.RadauIIA(), (1e-3, 1e-6)), (mbd.RungeKutta853(), (1e-3, 1e-7)), (mbd.HHT(alpha=0.05), (3e-3,))],
    ids=["radau", "explicit", "hht"],
)
def test_what_is_asked_for_is_as_accurate_as_tol_says(name, scheme, tols):
    model, start, exact = scene(name)
    names = ASKED[name]
    times = np.linspace(0.0, 0.8, 167)
    for tol in tols:
        run = mbd.simulate(model, start, scheme, tol=tol, tol_of=names, until=0.8)
        told = run.stats["tolerance"]
        ours, true = run.at(times), exact.at(times)
        error = max(np.max(np.abs(ours[one] - true[one])) for one in names)
        assert error < 2.0 * tol, (tol, error)
        assert told["requested"] == tol and told["estimated"] <= tol
        better = any("far below tol" in note for note in run.stats["notes"])
        assert better or error > 0.05 * tol
        assert set(told["of"]) == set(run.settings["tol_of"])
        assert {one.removesuffix(".x").removesuffix(".y").removesuffix(".z") for one in told["of"]} == set(names)


def test_a_coordinate_that_nobody_asks_for_costs_no_steps():
    model, start, _ = scene("turning")
    steps = [
        mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-7, until=0.8, **more).stats["steps"]
        for more in ({}, {"tol_of": ["hinge.angle"]})
    ]
    assert 1.5 * steps[1] < steps[0]


def test_forces_asked_for_cost_more_steps_than_coordinates():
    model, start, _ = scene("redundant")
    plain = mbd.simulate(model, start, mbd.RadauIIA(), tol=1e-6, until=0.8).stats["steps"]
    asked = mbd.simulate(model, start, mbd.RadauIIA(), tol=1e-6, tol_of=["P3.reaction_torque"], until=0.8)
    assert asked.stats["steps"] > plain


@pytest.mark.parametrize(
    ("wanted", "kind", "said"),
    [
        ("P1.angle", ModelError, r"tol_of must be a list of results such as \['P1.angle'\], not 'P1.angle'"),
        ([], ModelError, "tol_of is empty"),
        ([3], ModelError, "tol_of must be a list of results"),
        (
            ["P1.angel", "P3.reaction_forc"],
            UnknownNameError,
            "(?s)did you mean 'P1.angle'.*did you mean 'P3.reaction_f",
        ),
        (["rod 0.length"], UnknownNameError, "tol_of: no result named 'rod 0.length'"),
    ],
)
def test_names_are_checked_before_the_first_step(wanted, kind, said):
    model, start = bricard()
    with pytest.raises(kind, match=said):
        mbd.simulate(model, start, tol=1e-3, tol_of=wanted, until=0.1)


def test_what_does_not_move_and_a_missing_tol_are_refused():
    model, start, _ = scene("turning")
    with pytest.raises(ModelError, match="is the same whatever the motion and has no error"):
        mbd.simulate(model, start, tol=1e-3, tol_of=["ground.origin.x"], until=0.1)
    with pytest.raises(ModelError, match="tol_of=.* says what tol holds for; give tol too"):
        mbd.simulate(model, start, dt=1e-3, tol_of=["hinge.angle"], until=0.1)
