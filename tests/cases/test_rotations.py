"""Cases e1 to e4, d4, d5, l7 and l8: bodies that turn freely, with every scheme at its full order."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
import pytest

import mbd
from mbd.integrators import Integrator
from tests.cases.schemes import name_of
from tests.cases.spatial import Made, Numbers, asymmetric_body, coin, double_pendulum, spun, tree
from tests.problems import Case, case

ERRORS = Callable[[mbd.Trajectory], float]
QUICK: list[Integrator] = [mbd.RungeKutta853(), mbd.RadauIIA(), mbd.GeneralizedAlpha(0.8), mbd.RungeKutta4()]
MORE: list[Integrator] = [mbd.Newmark(), mbd.HHT(0.05), mbd.GeneralizedAlpha(0.8, formulation="index3"), mbd.HHT(0.1)]
every_scheme = pytest.mark.parametrize(
    "scheme", [*QUICK, *(pytest.param(scheme, marks=pytest.mark.slow) for scheme in MORE)], ids=name_of
)


def require_order(made: Made, scheme: Integrator, steps: Sequence[float], until: float, errors: ERRORS) -> None:
    """The observed order of a scheme is its own; above order 5 at least, as errors near round-off tell no more."""
    found = [errors(mbd.simulate(*made, scheme, dt=dt, until=until)) for dt in steps]
    orders = [np.log2(a / b) for a, b in pairwise(found)]
    if scheme.order() > 5:
        assert found[-1] < 3e-11
        assert found[0] < 1e-10 or orders[0] > scheme.order() - 0.5
    else:
        assert orders[-1] == pytest.approx(scheme.order(), abs=0.1 if scheme.order() == 2 else 0.15), (found, orders)


def at_times(name: str, beginning: str, count: int, read: Callable[[mbd.results.columns.Columns], Numbers]) -> ERRORS:
    """The largest error of what is read, at the first times of a quantity."""
    wanted = case(name)[beginning]
    return lambda run: float(np.max(np.abs(read(run.at(wanted.t[:count])) - wanted.value[:count])))


def steps(scheme: Integrator, fine: Sequence[float], coarse: Sequence[float]) -> Sequence[float]:
    return coarse if scheme.order() > 4 else fine


@every_scheme
def test_a_free_body_turns_over_about_its_intermediate_axis(scheme: Integrator) -> None:
    errors = at_times("e1-dzhanibekov", "body angular velocity", 3, lambda values: values["ball.angular_velocity"])
    attitude = case("e1-dzhanibekov")["attitude"]
    dt = steps(scheme, (0.01, 0.005), (0.02, 0.01))
    require_order(asymmetric_body(), scheme, dt, 7.0, errors)
    run = mbd.simulate(*asymmetric_body(), scheme, dt=dt[-1], until=7.0)
    q = run.at(attitude.t)["ball.orientation"]
    q = q * np.sign(np.sum(q * attitude.value, axis=1))[:, None]
    assert np.max(np.abs(q - attitude.value)) < {2: 1e-3, 4: 1e-6, 5: 1e-9, 8: 3e-11}[scheme.order()]
    np.testing.assert_allclose(np.sum(run.record.q**2, axis=1), 1.0, atol=4e-15)


def released(name: str) -> Made:
    given: Case = case(name)
    return spun(name, 0.0, float(given.start["phidot"]), float(given.start["theta"]))


@every_scheme
@pytest.mark.parametrize(("name", "until", "fine", "coarse"), [
    ("e2-heavy-top-nutation", 0.2, (5e-4, 2.5e-4), (2e-3, 1e-3)),
    pytest.param("e3-fast-top", 0.1, (5e-5, 2.5e-5), (2e-4, 1e-4), marks=pytest.mark.slow),
], ids=["e2", "e3"])  # fmt: skip
def test_the_axis_of_a_top_nods_as_it_must(
    scheme: Integrator, name: str, until: float, fine: Sequence[float], coarse: Sequence[float]
) -> None:
    errors = at_times(name, "axis unit vector", 2, lambda values: values["body.axis"])
    require_order(released(name), scheme, steps(scheme, fine, coarse), until, errors)


def test_nutation_of_a_top_stays_within_its_limits() -> None:
    run = mbd.simulate(*released("e2-heavy-top-nutation"), mbd.RungeKutta853(), dt=1e-3, until=0.5)
    theta = np.arccos(run.at(np.linspace(0.0, 0.5, 20001))["body.axis"][:, 2])
    limits = case("e2-heavy-top-nutation")["nutation limits"]
    np.testing.assert_allclose([theta.min(), theta.max()], limits.value, atol=limits.accuracy)
    assert run.energy.kinetic[0] + 0.5886 * np.cos(0.5) == pytest.approx(
        case("e2-heavy-top-nutation")["energy"].value, abs=1e-8
    )


@pytest.mark.parametrize("which", ["slow", "fast"])
def test_a_top_precesses_steadily_at_either_rate(which: str) -> None:
    given = case("e3b-steady-precession")
    theta, rate = float(given.start["theta"]), float(given[f"{which} steady"].value)
    spin = float(given.start["omega3"]) - rate * np.cos(theta)
    run = mbd.simulate(*spun(given.name, rate, spin, theta), mbd.RungeKutta853(), dt=2e-3, until=1.0)
    axis = run["body.axis"]
    assert np.ptp(np.arccos(axis[:, 2])) < 1e-11
    assert np.unwrap(np.arctan2(axis[:, 0], -axis[:, 1]))[-1] == pytest.approx(rate, abs=1e-10)


@every_scheme
@pytest.mark.parametrize("cut", ["auto", pytest.param("all", marks=pytest.mark.slow)])
def test_a_double_pendulum_in_space_however_it_is_cut(scheme: Integrator, cut: str) -> None:
    made = double_pendulum(cut)

    def centers(values: mbd.results.columns.Columns) -> Numbers:
        return np.hstack([values["first.center"], values["second.center"]])

    errors = at_times("e4-3d-double-pendulum", "[centre1", 2, centers)
    require_order(made, scheme, steps(scheme, (0.004, 0.002), (0.02, 0.01)), 1.5, errors)
    run = mbd.simulate(*made, scheme, dt=1e-3, until=2e-3)
    forces = np.hstack([run["upper.reaction_force"][0], run["lower.reaction_force"][0]])
    np.testing.assert_allclose(forces, case("e4-3d-double-pendulum")["joint forces"].value, atol=1e-10)


def on_edge(name: str, lean: float, omega: Numbers, place: Sequence[float] = (0.0, 0.0)) -> Made:
    given = {"float.x": place[0], "float.y": place[1], "float.orientation": ("xyz", (lean, 0.0, 0.0))}
    return coin(name), mbd.assemble(coin(name), given, {"float.angular_velocity.ground": omega})


@every_scheme
def test_a_coin_rolls_on_its_edge(scheme: Integrator) -> None:
    given = case("d4-rolling-disk")
    made = on_edge(given.name, float(given.start["lean_from_vertical"]), given.start["omega"],
                   given.start["centre"][:2])  # fmt: skip
    errors = at_times(given.name, "centre of disk", 2, lambda values: values["disk.center"])
    require_order(made, scheme, steps(scheme, (4e-3, 2e-3), (0.03, 0.015)), 1.5, errors)


def test_a_coin_rolls_steadily_in_a_circle() -> None:
    given = case("d5-disk-steady-turn")
    lean, heading, spin = (float(x) for x in (given.start["lean"], given.start["heading_rate"],
                                              given["spin rate phidot needed"].value))  # fmt: skip
    omega = heading * np.array([0.0, 0.0, 1.0]) + spin * np.array([0.0, np.cos(lean), np.sin(lean)])
    run = mbd.simulate(*on_edge(given.name, lean, omega), mbd.RungeKutta853(), dt=0.01, until=3.0)
    leaned = np.arcsin(run["disk.normal.z"] - run["disk.center.z"])
    assert np.max(np.abs(leaned - lean)) < 1e-12
    radius = float(given["radius of the contact circle"].value) - 0.5 * np.sin(lean)  # of the center's
    speed = np.hypot(run["disk.center.vx"], run["disk.center.vy"])
    np.testing.assert_allclose(speed, heading * radius, rtol=1e-12)
    assert run.violation.length < 1e-12


def bodies(name: str) -> list[str]:
    return [each["name"] for each in case(name).definition["bodies"]]


@every_scheme
@pytest.mark.parametrize("name", ["l7-satellite-arm",
                                  pytest.param("l8-humanoid-free-flight", marks=pytest.mark.slow)])  # fmt: skip
def test_bodies_in_flight(scheme: Integrator, name: str) -> None:
    def centers(values: mbd.results.columns.Columns) -> Numbers:
        return np.stack([values[f"{body}.center"] for body in bodies(name)], axis=1)

    made = tree(name)
    assert mbd.mobility(*made).dof == case(name)["number of degrees of freedom"].value
    wanted = case(name)["mass centres"]
    errors = at_times(name, "mass centres", 2, centers)
    dt = (0.01, 0.005) if name.startswith("l7") else (2.5e-3, 1.25e-3)
    require_order(made, scheme, steps(scheme, dt, tuple(4.0 * each for each in dt)), float(wanted.t[1]), errors)


def test_momentum_and_energy_of_a_satellite_with_an_arm_stay() -> None:
    model, start = tree("l7-satellite-arm")
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=1.0)
    masses = [run.parameters[f"{body}.mass"] for body in bodies("l7-satellite-arm")]
    linear = sum(m * np.column_stack([run[f"{body}.center.v{axis}"] for axis in "xyz"])
                 for m, body in zip(masses, bodies("l7-satellite-arm"), strict=True))  # fmt: skip
    wanted = case("l7-satellite-arm")["linear momentum"].value[0]
    np.testing.assert_allclose(linear, np.broadcast_to(wanted, linear.shape), atol=1e-9)
    energy = float(case("l7-satellite-arm")["total energy"].value)
    np.testing.assert_allclose(run.energy.kinetic + run.energy.potential, energy, atol=1e-8)
