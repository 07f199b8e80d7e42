"""Cases d1 (Chaplygin sleigh), d2 (knife edge on an incline) and d3 (rolling wheel): rows on velocities."""

from __future__ import annotations

import math

import numpy as np
import pytest

import mbd
from mbd.integrators.family import NewmarkFamily
from tests.cases.schemes import INDEX_3, SCHEMES, name_of
from tests.cases.sleighs import Sleigh, blade_row, rolling_wheel
from tests.helpers import assert_second_order
from tests.problems import case

D1, D2, D3 = case("d1-chaplygin-sleigh"), case("d2-knife-edge-incline"), case("d3-rolling-wheel")
EVERY = [*SCHEMES, *INDEX_3, mbd.Newmark(formulation="index3"), mbd.HHT(0.05, form="averaged")]
"""Rows on velocities are held alike in both formulations, so that undamped index 3 serves them too."""
every_scheme = pytest.mark.parametrize("scheme", EVERY, ids=name_of)


# d1 -----------------------------------------------------------------------------------------------------------------
SLEIGH = Sleigh(D1.definition["m"], D1.definition["I_G"], D1.definition["a"])
BEGIN = D1.start["theta0"], D1.start["v_along_blade"], D1.start["thetadot0"]


def reference_motion() -> tuple[np.ndarray, np.ndarray]:
    """The instants of d1, and (v, ω, θ, x, y, side force) at each."""
    motion, place, force = D1["[blade speed"], D1["contact point P"], D1["side force"]
    return motion.t, np.column_stack([motion.value, place.value, force.value])


def found_motion(run: mbd.Trajectory, times: np.ndarray) -> np.ndarray:
    """The same of a run."""
    at = run.at(times)
    angle = at["body.angle"]
    speed = at["body.x.rate"] * np.cos(angle) + at["body.y.rate"] * np.sin(angle)
    return np.column_stack([speed, at["body.angle.rate"], angle, at["body.x"], at["body.y"], at["blade.force"]])


def is_averaged(scheme: NewmarkFamily) -> bool:
    """The averaged form is of second order only where M is constant; that of the sleigh turns with it."""
    return getattr(scheme, "form", "endpoint") == "averaged"


@pytest.mark.parametrize("scheme", EVERY[:-1], ids=name_of)
def test_the_sleigh_meets_its_references(scheme: NewmarkFamily) -> None:
    model = SLEIGH.model()
    start = SLEIGH.start(model, *BEGIN)
    times, reference = reference_motion()

    def errors(dt: float) -> np.ndarray:
        run = mbd.simulate(model, start, scheme, dt=dt, until=times[-1])
        assert np.abs(run["blade.residual"]).max() < 1e-10
        assert np.ptp(run["kinetic_energy"]) < 0.2 * dt * dt * 6.0
        assert run["kinetic_energy"][0] == pytest.approx(D1["kinetic energy"].value, abs=1e-12)
        return np.linalg.norm(found_motion(run, times)[:, :5] - reference[:, :5], axis=0)

    assert_second_order(errors, 0.02, halvings=4)
    run = mbd.simulate(model, start, scheme, dt=1e-3, until=times[-1])
    assert found_motion(run, times) == pytest.approx(reference, abs=3e-6)


def test_the_sleigh_tends_to_a_straight_line_at_its_limit_speed() -> None:
    model = SLEIGH.model()
    run = mbd.simulate(model, SLEIGH.start(model, *BEGIN), mbd.GeneralizedAlpha(0.9), dt=1e-3, until=12.0)
    assert abs(run["body.angle.rate"][-1]) < 1e-4
    speed = math.hypot(run["body.x.rate"][-1], run["body.y.rate"][-1])
    assert speed == pytest.approx(D1["limit speed"].value, abs=1e-6)


@every_scheme
def test_a_pulled_sleigh_of_other_sizes_follows_its_reduced_equations(scheme: NewmarkFamily) -> None:
    """All along, with the side force; by rows of a blade and by hand."""
    sleigh = Sleigh(mass=1.7, inertia=0.31, ahead=-0.23, pull=0.9)
    model = sleigh.model(by_hand=scheme.formulation == "index3")
    begin = (0.8, 0.5, -1.6)
    start = sleigh.start(model, *begin)

    def errors(dt: float) -> np.ndarray:
        run = mbd.simulate(model, start, scheme, dt=dt, until=3.0)
        assert np.abs(run["blade.residual"]).max() < 1e-10
        reference = sleigh.motion(*begin, run.time[1:])[:, [3, 4, 2, 0, 1, 5]]
        return np.abs(found_motion(run, run.time)[1:] - reference).max(axis=0)

    if is_averaged(scheme):
        assert errors(0.0025).max() < 0.02
    else:
        assert_second_order(errors, 0.02, halvings=4)


def test_the_sleighs_energy_error_is_that_of_the_scheme() -> None:
    """The blade does no work: what changes is 'numerical', and it falls with dt²."""
    model = SLEIGH.model()
    start = SLEIGH.start(model, *BEGIN)

    def gained(dt: float) -> float:
        energy = mbd.simulate(model, start, mbd.Newmark(), dt=dt, until=6.0).energy
        assert set(energy.sums) == {"numerical"}
        return float(np.abs(energy.numerical).max())

    assert_second_order(gained, 0.02)
    assert gained(1e-3) < 1e-6


# d2 -----------------------------------------------------------------------------------------------------------------
def edge() -> tuple[mbd.Model, mbd.State]:
    """The knife edge of d2 in axes of the incline, x downhill, as a row of the user's own."""
    mass, inertia = D2.definition["m"], D2.definition["I"]
    model = mbd.Model("edge", gravity=(D2.definition["g"] * math.sin(D2.definition["slope"]), 0.0, 0.0))
    body = mbd.RigidBody("edge", mass, (0.5 * inertia, 0.5 * inertia, inertia))
    model.connect(mbd.Planar("body", model.ground.origin, body.origin))
    names = ("body.x.rate", "body.y.rate", "body.angle")
    model.constrain(mbd.Nonholonomic("blade", blade_row, arguments=names))
    return model, mbd.assemble(model, velocity={"body.angle": D2.start["thetadot"]})


@every_scheme
def test_the_knife_edge_on_an_incline_meets_its_references(scheme: NewmarkFamily) -> None:
    model, start = edge()
    place = D2["[x, y]"]

    def errors(dt: float) -> np.ndarray:
        run = mbd.simulate(model, start, scheme, dt=dt, until=5.0)
        assert np.abs(run["blade.residual"]).max() < 1e-10
        at = run.at(place.t)
        assert at["blade.multiplier"] == pytest.approx(D2["multiplier"].value, abs=0.3 * dt * dt)
        assert at["blade.force"] == pytest.approx(-at["blade.multiplier"])
        return np.linalg.norm(np.column_stack([at["body.x"], at["body.y"]]) - place.value, axis=0)

    assert_second_order(errors, 0.02, halvings=4)


def test_the_knife_edge_does_not_slide_downhill() -> None:
    model, start = edge()
    omega = D2.start["thetadot"]
    run = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.9), dt=1e-3, until=40 * math.pi / omega)
    assert run["body.x"].max() == pytest.approx(D2["max downhill"].value, abs=3e-6)
    assert abs(run["body.x"][-1]) < 1e-5
    assert run["body.y"][-1] / run.time[-1] == pytest.approx(D2["mean sideways"].value, abs=1e-5)


# d3 -----------------------------------------------------------------------------------------------------------------
SIZES = [D3.definition[name] for name in ("m", "R", "J", "slope", "g")]


@pytest.mark.parametrize("held", ["row", "contact", "joint"])
@every_scheme
def test_a_rolling_wheel_is_exact_at_any_step(scheme: NewmarkFamily, held: str) -> None:
    """Constant acceleration, by which every scheme of the family is exact."""
    model = rolling_wheel(*SIZES, held=held)
    start = mbd.assemble(model, closed=["road"] if held == "contact" else [])
    if held != "joint" and scheme.formulation == "index3" and scheme.coefficients.undamped:
        with pytest.raises(mbd.CapabilityError, match="no damping"):  # beside rows on positions
            mbd.simulate(model, start, scheme, dt=0.1, until=3.0)
        return
    place, angle = ("slide.displacement", "axle.angle") if held == "joint" else ("roll.x", "roll.angle")
    for dt in 0.1, 0.01:
        run = mbd.simulate(model, start, scheme, dt=dt, until=3.0)
        assert run[place][-1] == pytest.approx(D3["x(3 s)"].value, abs=1e-11)
        assert run[angle][-1] == pytest.approx(-D3["wheel angle"].value, abs=1e-11)
        assert run[f"{place}.acceleration"] == pytest.approx(D3["acceleration"].value, abs=1e-9)
        assert run["tyre.force"] == pytest.approx(D3["friction force"].value, abs=1e-9)
        assert np.abs(run["tyre.residual"]).max() < 1e-10
        if held != "joint":
            normal = run["road.force"] if held == "contact" else -run["road.multiplier"]
            needed = np.abs(run["tyre.force"]) / normal
            assert needed == pytest.approx(D3["minimum static friction"].value, abs=1e-9)
