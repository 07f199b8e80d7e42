"""Case j14: a point mass that starts off its circle and with a speed along the rod."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

import mbd
from tests.problems import case

J14 = case("j14-inconsistent-initial")
x, y, vx, vy = (J14.start[name] for name in ("x", "y", "vx", "vy"))
L = J14.definition["L"]
VELOCITY_OFF = J14["velocity residual"].value
NAMED = {
    "position": {"bob place.x": x, "bob place.y": y},
    "velocity": {"bob place.x": vx, "bob place.y.rate": vy},
}


def bob(measure: str) -> mbd.Model:
    """The point mass on a rod, held by its distance or by ``(x² + y² − L²)/L`` [m]."""
    model = mbd.Model("bob", gravity=(0.0, -J14.definition["g"], 0.0))
    mass = mbd.PointMass("bob", J14.definition["m"])
    model.connect(mbd.Translation("bob place", model.ground.origin, mass.origin))
    if measure == "distance":
        model.constrain(mbd.Bilateral("rod", mbd.distance(model.ground.origin, mass.origin), value=L))
    else:
        circle = mbd.measure(lambda x, y: (x * x + y * y - L * L) / L, "bob place.x", "bob place.y")
        model.constrain(mbd.Bilateral("rod", circle))
    return model


def residuals(model: mbd.Model, **named: object) -> tuple[float, float]:
    """Both residuals that the refusal tells, and that it tells whose they are."""
    with pytest.raises(mbd.AssemblyError, match="'rod'") as refusal:
        mbd.assemble(model, **named)
    number = r"(-?[\d.]+(?:e-?\d+)?)"
    found = re.search(rf"position residual {number} .*velocity residual {number} ", str(refusal.value))
    assert found is not None
    assert "project=True" in str(refusal.value)
    return float(found[1]), float(found[2])


def test_a_start_off_the_circle_is_refused_with_both_residuals_of_the_rod() -> None:
    position, velocity = residuals(bob("distance"), **NAMED)
    assert position == pytest.approx(math.hypot(x, y) - L, rel=1e-5)
    assert velocity == pytest.approx(VELOCITY_OFF / math.hypot(x, y), rel=1e-5)


def test_projection_gives_the_nearest_consistent_start_and_tells_how_far_it_moved() -> None:
    start = mbd.assemble(bob("distance"), **NAMED, project=True)
    position = J14["mass-orthogonal projection of the position"].value
    velocity = J14["mass-orthogonal projection of the velocity"].value
    assert start.q == pytest.approx(position, abs=1e-12)
    assert start.v == pytest.approx(velocity, abs=1e-12)
    moved = np.array([*position, *velocity]) - [x, y, vx, vy]
    names = ["bob place.x", "bob place.y", "bob place.x.rate", "bob place.y.rate"]
    assert [start.moved[name] for name in names] == pytest.approx(moved, abs=1e-12)
    assert "moved 4 of these; farthest 'bob place.x.rate' by -0.28" in repr(start)


@pytest.mark.parametrize("scheme", [mbd.Newmark(), mbd.HHT(), mbd.HHT(formulation="index3")], ids=repr)
def test_the_projected_start_has_the_tension_of_its_circle(scheme: mbd.Newmark) -> None:
    """Already in the first row; nor is there a multiplier of residual/(β dt²) in the rows after it."""
    model = bob("distance")
    start = mbd.assemble(model, **NAMED, project=True)
    run = mbd.simulate(model, start, scheme, dt=1e-3, until=0.01)
    assert run["rod.tension"][0] == pytest.approx(J14["tension at the projected state"].value, abs=1e-11)
    assert np.max(np.abs(np.diff(run["rod.tension"]))) < (0.05 if scheme.formulation == "ggl" else 0.5)


@pytest.mark.parametrize("measure", ["distance", "x² + y²"])
def test_a_start_off_in_its_velocity_alone_is_refused_too(measure: str) -> None:
    """Another start, with another mass: on the circle, but with a speed along the rod."""
    place = {"bob place.x": 0.6, "bob place.y": -0.8}
    position, velocity = residuals(bob(measure), position=place, velocity={"bob place.x": 1.0, "bob place.y": 0.2})
    along = 0.6 * 1.0 - 0.8 * 0.2
    assert abs(position) < 1e-12
    assert velocity == pytest.approx(along if measure == "distance" else 2 * along, rel=1e-5)


def test_what_is_not_named_is_completed_and_what_is_named_is_held() -> None:
    """The unnamed coordinate goes from its default to the nearer of two places, its rate follows."""
    bead = mbd.Lagrangian(
        "bead",
        [mbd.Coordinate("x", unit="m"), mbd.Coordinate("y", unit="m", default=-1.0)],
        kinetic=lambda x_rate, y_rate: 0.5 * (x_rate**2 + y_rate**2),
        constraints={"ring": lambda x, y: x * x + y * y - 1.0},
    )
    start = mbd.assemble(bead, position={"x": 0.6}, velocity={"x": 1.0})
    assert start["x"] == 0.6
    assert start["y"] == pytest.approx(-0.8, abs=1e-14)
    assert start["x.rate"] == 1.0
    assert start["y.rate"] == pytest.approx(0.75, abs=1e-13)
    assert set(start.moved) == {"y", "y.rate"}


def test_every_contradicted_rod_is_named_at_once() -> None:
    model = bob("distance")
    second = mbd.PointMass("second", 2.0)
    model.connect(mbd.Translation("second place", model.ground.origin, second.origin))
    model.constrain(mbd.Bilateral("second rod", mbd.distance(model.ground.origin, second.origin), value=0.5))
    with pytest.raises(mbd.AssemblyError) as refusal:
        mbd.assemble(model, position={**NAMED["position"], "second place.x": 0.7, "second place.y": 0.0})
    assert len(refusal.value.faults) == 2
    assert "'rod'" in refusal.value.faults[0]
    assert "'second rod'" in refusal.value.faults[1]
    assert "position residual 0.2 m" in refusal.value.faults[1]
