"""The energy ledger cause by cause, against closed forms; what it leaves over is the integrator's."""

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate._ivp import dop853_coefficients as tableau

import mbd
from mbd.errors import ModelError
from mbd.gait.cycle import cost_of_transport, energy_by_cause
from mbd.integrators import Integrator, StepReport, StepResult
from mbd.integrators.base import consistent_rates
from mbd.results.forces import Forces
from mbd.results.ledger import KINDS, Ledger, Part
from mbd.results.quadrature import cumulative

SCHEMES = (mbd.Newmark(), mbd.HHT(alpha=0.05), mbd.GeneralizedAlpha(rho_inf=0.8))

LOSS = mbd.Viscous(0.2) + mbd.Quadratic(0.1)


def slider(stiffness: float = 0.0, gravity: float = 0.0, loss=None, mass: float = 2.0) -> mbd.Model:
    """A mass on a rail along x, or upwards along y under gravity, with the spring and the loss of the rail."""
    model = mbd.Model("slider", gravity=(0.0, -gravity, 0.0))
    body = mbd.PointMass("body", mass=mass)
    axis = (0.0, 1.0, 0.0) if gravity else (1.0, 0.0, 0.0)
    model.connect(
        mbd.Prismatic("rail", model.ground.origin, body.origin, axis=axis, stiffness=stiffness, loss=loss)
    )  # fmt: skip
    return model


def run_of(model: mbd.Model, scheme=None, dt: float = 1e-3, until: float = 1.0, q: float = 0.0, v: float = 0.0):
    start = mbd.assemble(model, position={"rail.displacement": q}, velocity={"rail.rate": v})
    return mbd.simulate(model, start, scheme or mbd.Newmark(), dt=dt, until=until)


def struck_leg(scheme, dt: float, loss=LOSS):
    """A motor swings a damped double pendulum on a damper against a wall, which throws it back."""
    model = mbd.Model("struck leg")
    thigh = mbd.Link("thigh", mass=1.0, length=0.5, center=0.2, inertia=0.02)
    shank = mbd.Link("shank", mass=0.5, length=0.5, center=0.2, inertia=0.01)
    hip = mbd.Revolute("hip", model.ground.origin, thigh.start, loss=loss)
    knee = mbd.Revolute("knee", thigh.end, shank.start, stiffness=2.0)
    model.connect(hip, knee)
    model.apply(
        mbd.Motor("hip motor", hip, torque=lambda t: 3.0 * mbd.sin(6.0 * t)),
        mbd.Damper("strut", model.ground.point(0.8, 0.1), shank.end, 0.7),
    )
    model.constrain(mbd.Unilateral("wall", mbd.measure(lambda angle: angle - 0.2, "hip.angle"), restitution=0.6))
    start = mbd.assemble(model, position={"hip.angle": 0.5}, velocity={"knee.rate": 2.0})
    return mbd.simulate(model, start, scheme, dt=dt, until=0.8)


@dataclass(frozen=True)
class DormandPrince(Integrator):
    """The method of order 8 of Dormand & Prince (Hairer, Nørsett & Wanner 1993, II.5), with fixed steps."""

    def order(self, system=None):
        return 8

    def start(self, system, state, mode, dt):
        return None

    def step(self, system, state, dt, mode, memory):
        n, y, rates = len(state.v), np.concatenate([state.q, state.v]), []
        for c, row in zip(tableau.C[:12], tableau.A[:12], strict=True):
            here = y + dt * sum((a * rate for a, rate in zip(row, rates, strict=False)), np.zeros(2 * n))
            accelerations, _ = consistent_rates(system, state.time + c * dt, here[:n], here[n:], mode)
            rates.append(np.concatenate([here[n:], accelerations]))
        y = y + dt * sum(b * rate for b, rate in zip(tableau.B, rates, strict=True))
        return StepResult(replace(state, time=state.time + dt, q=y[:n], v=y[n:]), None, StepReport(True, residual=0.0))


def test_the_ledger_hides_no_order_of_a_scheme_of_order_8_across_an_impact():
    runs = [struck_leg(DormandPrince(), dt, mbd.Viscous(0.2)) for dt in (0.02, 0.01, 0.005)]
    left = [float(np.max(np.abs(run.energy.numerical))) for run in runs]
    assert all(run.energy["impact"][-1] < -0.1 for run in runs)
    assert all(np.log2(a / b) > 7.5 for a, b in pairwise(left)) and left[-1] < 1e-11


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_the_remainder_falls_with_order_2_on_a_damped_driven_leg_that_strikes(scheme):
    runs = [struck_leg(scheme, dt) for dt in (2e-3, 1e-3, 5e-4)]
    assert all(any(event.name == "wall" and event.impulse.any() for event in run.events) for run in runs)
    left = [abs(float(run.energy.numerical[-1])) for run in runs]
    assert all(1.8 < np.log2(a / b) < 2.2 for a, b in pairwise(left))
    books = runs[-1].energy
    assert books.kinds == ("joint loss", "damper", "impact", "motor")
    assert {part.name: part.kind for part in books.parts} == {
        "hip loss": "joint loss", "strut": "damper", "hip motor": "motor", "wall impact": "impact",
    }  # fmt: skip


@pytest.mark.parametrize("scheme", [mbd.HHT(alpha=0.1), mbd.GeneralizedAlpha(rho_inf=0.5)], ids=str)
def test_the_remainder_is_the_algorithmic_damping_of_a_linear_oscillator(scheme):
    """Over N periods E falls by 1 − exp(−2 ζ ω t), ζ being the scheme's own damping ratio at this ω dt."""
    omega, periods, turn = 2.0 * math.pi, 10.0, 0.2
    run = run_of(slider(stiffness=2.0 * omega**2), scheme, dt=turn / omega, until=periods, q=0.1)
    zeta = mbd.criteria(scheme, turns=[turn]).spectra[0].damping
    lost = run.energy.total[0] * (1.0 - math.exp(-2.0 * zeta * omega * periods))
    assert run.energy.parts == () and zeta > 1e-5
    assert -run.energy.numerical[-1] == pytest.approx(lost, rel=0.02)


@pytest.mark.parametrize("xi", [0.005, 0.02])
def test_beside_a_damper_the_remainder_is_what_the_scheme_damps_too_little(xi):
    """The trapezoidal rule damps ξ (ω dt)²/4 less than the damper takes: it gains, as its eigenvalue says."""
    omega, periods, turn = 2.0 * math.pi, 10.0, 0.2
    model = slider(stiffness=2.0 * omega**2, loss=mbd.Viscous(4.0 * xi * omega))
    run = run_of(model, mbd.Newmark(), dt=turn / omega, until=periods, q=0.1)
    decay = -2.0 * math.log(abs(mbd.criteria(mbd.Newmark(), xi, turns=[turn]).spectra[0].principal)) / turn * omega
    gained = run.energy.total[0] * (2.0 * xi * omega / decay - 1.0) * (1.0 - math.exp(-decay * periods))
    assert run.energy.numerical[-1] == pytest.approx(gained, rel=0.01)
    assert decay == pytest.approx(2.0 * xi * omega * (1.0 - turn**2 / 4.0), rel=1e-3)


def test_a_viscous_loss_takes_what_the_decay_says():
    """x = e^(−δt) (…): the energy lost by the damper is that of the oscillator, E(0) − E(t) in closed form."""
    mass, c, k, x0, until = 2.0, 1.2, 50.0, 0.3, 1.5
    run = run_of(slider(stiffness=k, loss=mbd.Viscous(c)), dt=2e-4, until=until, q=x0)
    delta, omega = c / (2.0 * mass), math.sqrt(k / mass - (c / (2.0 * mass)) ** 2)
    decay, turn = math.exp(-delta * until), omega * until
    x = x0 * decay * (math.cos(turn) + delta / omega * math.sin(turn))
    v = -x0 * decay * (omega + delta**2 / omega) * math.sin(turn)
    lost = 0.5 * k * (x0**2 - x**2) - 0.5 * mass * v**2
    assert run.energy["rail loss"][-1] == pytest.approx(-lost, rel=1e-6)
    assert run.energy["rail spring"][-1] == pytest.approx(0.5 * k * x**2, rel=1e-4)


def test_dry_friction_takes_its_force_times_the_path():
    """A pendulum with Coulomb friction comes to rest: T times the angle that it has turned."""
    model = mbd.Model("pendulum")
    rod = mbd.Link("rod", mass=1.0, length=0.5, center=0.5)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.Coulomb(0.3)))
    run = mbd.simulate(model, mbd.assemble(model, position={"pin.angle": 1.0}), mbd.Newmark(), dt=5e-4, until=8.0)
    path = float(np.sum(np.abs(np.diff(run["pin.angle"]))))
    assert abs(run["pin.rate"][-1]) < 1e-12 and [part.kind for part in run.energy.parts] == ["friction"]
    assert run.energy["pin friction"][-1] == pytest.approx(-0.3 * path, rel=1e-6)
    assert abs(run.energy.numerical[-1]) < 1e-6


def test_an_impact_takes_half_m_v_squared_times_one_less_e_squared():
    mass, g, height, e = 2.0, 10.0, 0.8, 0.6
    model = slider(gravity=g, mass=mass)
    body = model.joints[0].child
    model.constrain(mbd.Unilateral("floor", mbd.height(body), restitution=e))
    run = run_of(model, q=height, until=1.1)
    hits = [event for event in run.events if event.kind == "closed"]
    column = run.energy["floor impact"]
    speeds = [math.sqrt(2.0 * g * height) * e**k for k in range(len(hits))]
    losses = [0.5 * mass * (1.0 - e**2) * speed**2 for speed in speeds]
    assert len(hits) == 2
    for event, lost in zip(hits, losses, strict=True):
        assert column[event.row - 1] - column[event.row] == pytest.approx(lost, rel=1e-9)


def test_dry_friction_of_a_pin_in_a_blow_stands_with_the_contact_that_struck():
    """Its impulse is not logged, but the energy is not the integrator's: the books close."""
    model = mbd.Model("pendulum")
    rod = mbd.Link("rod", mass=1.0, length=0.5, center=0.25, inertia=0.02)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.PinFriction(0.3, 0.05)))
    wall = mbd.measure(lambda angle: angle + 0.2, "pin.angle")
    model.constrain(mbd.Unilateral("wall", wall, restitution=0.6))
    run = mbd.simulate(model, mbd.assemble(model, position={"pin.angle": 1.0}), dt=1e-3, until=1.5)
    impact = next(event for event in run.events if event.impulse.any())
    taken = run.energy["wall impact"][impact.row - 1] - run.energy["wall impact"][impact.row]
    assert taken == pytest.approx(run.energy.kinetic[impact.row - 1] - run.energy.kinetic[impact.row], rel=1e-9)
    assert abs(run.energy.numerical[-1]) < 1e-6 and run.energy.kinds == ("friction", "impact")


def test_a_motor_gives_its_torque_times_the_angle():
    model = mbd.Model("wheel", gravity=(0.0, 0.0, 0.0))
    wheel = mbd.RigidBody("wheel", mass=1.0, inertia=0.5)
    axle = mbd.Revolute("axle", model.ground.origin, wheel.origin)
    model.connect(axle)
    model.apply(mbd.Motor("drive", axle, torque=1.5))
    run = mbd.simulate(model, mbd.assemble(model), dt=0.01, until=1.0)
    assert run.energy.kinds == ("motor",)
    np.testing.assert_allclose(run.energy["drive"], 1.5 * run["axle.angle"], atol=1e-12)


def test_a_penalty_stores_and_takes_what_the_blow_says():
    """Without damping −½ k δ² at every depth, and all of it back; with damping ½ m v² (1 − e²) is lost."""
    mass, k, speed = 2.0, 800.0, 1.0
    elastic, damped = slider(), slider()
    for model, damping in (elastic, 0.0), (damped, 8.0):
        wall = mbd.separation(model.ground.point(0.1, 0.0), model.joints[0].child, (-1.0, 0.0, 0.0))
        model.constrain(mbd.Penalty("wall", wall, stiffness=k, damping=damping))
    run = run_of(elastic, dt=1e-4, until=0.4, v=speed)
    depth = np.maximum(0.0, run["rail.displacement"] - 0.1)
    np.testing.assert_allclose(run.energy["wall"], -0.5 * k * depth**2, atol=1e-5)
    assert np.min(run.energy["wall"]) == pytest.approx(-0.5 * mass * speed**2, rel=1e-4)
    back = run_of(damped, dt=1e-4, until=0.4, v=speed)
    e = -float(back["rail.rate"][-1]) / speed
    zeta = 8.0 / (2.0 * math.sqrt(k * mass))
    assert e == pytest.approx(math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2)), rel=1e-3)
    assert back.energy["wall"][-1] == pytest.approx(-0.5 * mass * speed**2 * (1.0 - e**2), rel=1e-5)


@pytest.mark.parametrize("restitution", [0.3, 0.6, 0.9])
@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.GeneralizedAlpha(0.8)], ids=repr)
def test_the_sign_of_a_gap_of_round_off_tells_no_work(restitution, scheme):
    """The force of rubber is zero as it is touched and left, but not its rate: the remainder falls with order 2."""
    model, ball = mbd.Model("rubber"), mbd.PointMass("ball", 1.0)
    model.connect(mbd.Prismatic("fall", model.ground.origin, ball.origin, axis=(0.0, 1.0, 0.0)))
    model.constrain(mbd.Penalty("floor", mbd.height(ball.origin), stiffness=1300.0, restitution=restitution))
    start, found = mbd.assemble(model, {"fall.displacement": 0.7}), []
    for dt in (1e-3, 5e-4, 2.5e-4, 1.25e-4):
        begun = [
            mbd.simulate(model, replace(start, time=begin), scheme, dt=dt, until=begin + 1.3).energy.numerical[-1]
            for begin in (0.0, 16.0, -3.0)
        ]
        np.testing.assert_allclose(begun[1:], begun[0], rtol=1e-5)
        found.append(begun[0])
    np.testing.assert_allclose(np.array(found[:-1]) / found[1:], 4.0, rtol=0.05)


def test_a_signal_that_turns_is_asked_from_its_own_side():
    """A force in straight lines, whose impulse the trapezoidal rule has exactly: its kinks cost the work nothing."""
    model = slider()
    force = mbd.Samples([0.0, 0.3, 0.5, 2.0], [0.0, 4.0, 1.0, 1.0], kind="linear")
    model.apply(mbd.Motor("push", model.joints[0], torque=force))
    books = run_of(model, dt=0.02).energy
    impulse = 0.5 * 4.0 * 0.3 + 0.5 * (4.0 + 1.0) * 0.2 + 0.5
    assert books["push"][-1] == pytest.approx(impulse**2 / (2.0 * 2.0), rel=1e-12)
    assert np.max(np.abs(books.numerical)) < 1e-12


def test_stored_energies_make_the_potential():
    books = struck_leg(mbd.HHT(alpha=0.05), 2e-3).energy
    assert [(part.name, part.kind) for part in books.stored] == [("gravity", "gravity"), ("knee spring", "potential")]
    np.testing.assert_allclose(sum(part.energy for part in books.stored), books.potential, atol=1e-14)
    spring = books["knee spring"]
    assert books.stored[1].passed == pytest.approx(float(np.sum(np.abs(np.diff(spring)))))


def test_kinds_sum_to_the_change_and_are_found_by_name(tmp_path):
    run = struck_leg(mbd.HHT(alpha=0.05), 2e-3)
    books, again = run.energy, mbd.load(run.save(tmp_path / "run")).energy
    kinds = books.by_kind()
    assert [kind for kind in kinds if kind != "numerical"] == [kind for kind in KINDS if kind in kinds]
    assert sum(column[-1] for column in kinds.values()) == pytest.approx(books.change, abs=1e-12)
    np.testing.assert_array_equal(books["impact"], books["wall impact"])
    assert again.marks == books.marks == tuple((e.time, e.name) for e in run.events if e.kind != "opened")
    np.testing.assert_array_equal(again["knee spring"], books["knee spring"])
    assert repr(again) == repr(books)


def test_words_may_be_called_as_the_ledger_calls_its_own():
    """Dampers 'kinetic', 'total' and 'numerical', a spring 'damper', and a bushing that stores and takes."""
    model, body = slider(), None
    body = model.bodies["body"]
    far = model.ground.point(5.0, 0.0)
    model.apply(*(mbd.Damper(name, far, body.origin, 0.3) for name in ("kinetic", "total", "numerical")))
    model.apply(mbd.Spring("damper", far, body.origin, stiffness=20.0, length=5.0))
    model.apply(mbd.Bushing("bush", model.ground.origin, body.origin, stiffness=30.0, damping=2.0))
    run = run_of(model, v=1.0)
    energy = run.energy
    assert len(set(energy.sums)) == len(energy.parts) + 1
    assert sum(energy.sums.values()) == pytest.approx(energy.change, rel=1e-12)
    for name in ("kinetic", "potential", "total", "numerical"):
        np.testing.assert_array_equal(energy[name], getattr(energy, name))
        np.testing.assert_array_equal(energy.to_dataframe()[name], getattr(energy, name))
    assert energy["kinetic (damper)"][-1] == energy["total (damper)"][-1] < 0.0
    assert energy["bush"][-1] < 0.0 < energy["bush (potential)"][-1]
    given = energy_by_cause(run)
    assert given["damper"] == pytest.approx(sum(part.energy[-1] for part in energy.of("damper")))
    assert sum(given.values()) == pytest.approx(energy.kinetic[-1] - energy.kinetic[0], rel=1e-9)
    through = {each.name: each.energy for each in mbd.effects(model, mbd.assemble(model), 0.1, dt=0.01).contributions}
    assert through == dict.fromkeys(through, 0.0)
    study = mbd.effects(model, run.record.start, 1.0, mbd.Newmark(), dt=1e-3)
    bush = next(each for each in study.contributions if each.name == "bush")
    parts = [part.passed for part in (*energy.parts, *energy.stored) if part.name == "bush"]
    assert len(parts) == 2 and bush.energy == pytest.approx(sum(parts))


def test_the_drift_of_a_free_flywheel_is_no_quotient_of_round_off():
    """Its kinetic energy swings by 1e-15 J, and what the scheme gains by as much."""
    model, body = mbd.Model("flywheel", gravity=(0.0, 0.0, 0.0)), mbd.RigidBody("wheel", 1.3, (0.11, 0.27, 0.33))
    model.connect(mbd.Spherical("pin", model.ground.origin, body.origin))
    start = mbd.assemble(model, velocity={"pin.angular_velocity": (1.0, 2.0, 3.0)})
    assert mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=1.0).energy.drift < 1e-14


def test_a_cost_of_which_a_part_is_withheld_is_not_known():
    time, gone = np.array([0.0, 1.0]), np.full(2, np.nan)
    parts = (Part("knee loss", "joint loss", np.array([0.0, -2.0])), Part("foot", "penalty", gone, "too few rows"))
    run = SimpleNamespace(energy=Ledger(time, np.zeros(2), np.array([5.0, 2.0]), parts))
    given = energy_by_cause(run)
    assert given["joint loss"] == -2.0 and np.isnan(given["penalty"])
    model = SimpleNamespace(parameters={"hip.mass": 1.0, "gravity.y": -9.81}, bodies={"hip": None})
    assert np.isnan(cost_of_transport(given, model, {}, 1.0))
    assert cost_of_transport({"joint loss": -2.0}, model, {}, 1.0) == pytest.approx(2.0 / 9.81)


def test_the_ledger_is_a_table_by_element_or_by_kind():
    pytest.importorskip("pandas")
    books = struck_leg(mbd.HHT(alpha=0.05), 2e-3).energy
    table, kinds = books.to_dataframe(), books.to_dataframe(by="kind")
    first = ["kinetic", "potential", "total"]
    assert list(table) == [*first, "hip loss", "hip motor", "strut", "wall impact", "numerical"]
    assert list(kinds) == [*first, "joint loss", "damper", "impact", "motor", "numerical"]
    parts = table.drop(columns=first).sum(axis=1)
    np.testing.assert_allclose(parts, table["total"] - table["total"].iloc[0], atol=1e-12)
    with pytest.raises(ModelError, match="takes 'element' or 'kind', not 'cause'"):
        books.to_dataframe(by="cause")


def test_the_ledger_says_which_names_it_has():
    books = struck_leg(mbd.HHT(alpha=0.05), 2e-3).energy
    assert {"kinetic", "total", "hip loss", "joint loss", "numerical"} <= {*books}
    assert all(name in books and len(books[name]) == len(books.time) for name in books)
    assert "x" not in books and 0 not in books


def test_elements_of_one_kind_are_told_with_their_sum():
    model = slider(gravity=9.81, loss=mbd.Viscous(0.3), mass=1.0)
    other = mbd.PointMass("other", mass=1.0)
    model.connect(mbd.Prismatic("second", model.ground.origin, other.origin, axis=(0, 1, 0), loss=mbd.Viscous(0.1)))
    text = repr(mbd.simulate(model, mbd.assemble(model), dt=1e-2, until=1.0).energy)
    lines = [line.split() for line in text.splitlines()]
    total, *parts = (float(line[-1]) for line in lines if "loss" in line)
    assert total == pytest.approx(sum(parts), rel=1e-5) and len(parts) == 2


@pytest.mark.parametrize("with_rates", [True, False])
def test_polynomials_of_degree_7_are_integrated_exactly_on_uneven_rows(with_rates):
    rng = np.random.default_rng(3)
    first, second = (np.concatenate([[0.0], np.cumsum(rng.uniform(0.5, 1.5, 9))]) for _ in range(2))
    time = np.concatenate([first, first[-1] + second])  # a switch between them
    shape = np.polynomial.Polynomial(rng.normal(size=8), domain=[0.0, time[-1]])
    jump = np.arange(len(time)) >= len(first)
    values = shape(time) + 5.0 * jump
    work = cumulative(time, [(values, shape.deriv()(time) if with_rates else None)])[0]
    exact = shape.integ()(time) - shape.integ()(0.0) + 5.0 * jump * (time - first[-1])
    np.testing.assert_allclose(work, exact, rtol=1e-10, atol=1e-10)


def test_a_tiny_step_beside_full_ones_does_no_harm():
    """A row at the instant of an event may be any distance from the next."""
    time = np.sort(np.concatenate([np.linspace(0.0, 2.0, 41), [0.5 + 1e-9, 1.0 - 1e-13, 1.23456]]))
    work = cumulative(time, [(np.exp(-time), -np.exp(-time))])[0]
    np.testing.assert_allclose(work, 1.0 - np.exp(-time), atol=1e-9)


def test_nothing_is_integrated_without_an_interval():
    assert cumulative(np.zeros(0), [(np.zeros(0), None)])[0].shape == (0,)
    assert cumulative(np.zeros(2), [(np.ones(2), None)])[0].tolist() == [0.0, 0.0]


def blocks(count: int, friction: float):
    """Blocks thrown along a rough floor, or along a smooth one with drag, and where they begin."""
    model, velocity = mbd.Model("blocks"), {}
    for k in range(count):
        body = mbd.RigidBody(f"block {k}", 1.0 + k, (0.1, 0.2, 0.3))
        loss = {axis: mbd.Viscous(0.3) for axis in "xz"} if friction == 0.0 else None
        joint = mbd.Translation(f"place {k}", model.ground.origin, body.origin, axes="xyz", loss=loss)
        model.connect(joint)
        model.constrain(mbd.Unilateral(f"sole {k}", mbd.touchdown(body.origin), friction=friction))
        velocity |= {f"place {k}.x.rate": 2.0, f"place {k}.z.rate": 0.5 + k}
    return model, mbd.assemble(model, velocity=velocity, closed=[f"sole {k}" for k in range(count)])


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_forces_between_rows_are_solved_once_for_all_works_and_only_where_these_follow_them(monkeypatch, friction):
    counted = []
    at = Forces.at
    monkeypatch.setattr(Forces, "at", lambda self, places: counted.append(places) or at(self, places))
    for count in 1, 3:
        model, start = blocks(count, friction)
        run = mbd.simulate(model, start, mbd.RadauIIA(), dt=0.05, until=0.4)
        counted.clear()
        energy = run.energy
        assert abs(energy.numerical).max() < 1e-9 * energy.kinetic[0]
        assert len(counted) == (friction > 0.0)
