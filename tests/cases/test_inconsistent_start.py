"""Starts off their rows, beside the hard case j14: in velocity alone, completed, of several rods."""

import re

import pytest

import mbd
from tests.problems import case

J14 = case("j14-inconsistent-initial")
x, y, vx, vy = (J14.start[name] for name in ("x", "y", "vx", "vy"))
L = J14.definition["L"]
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
