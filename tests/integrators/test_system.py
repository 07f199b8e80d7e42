"""What a scheme may ask of a system: the tangent is that of the residual, and a user's own class gives what it has."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.integrators import Point, System, Terms
from mbd.integrators.base import consistent_rates
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.simulation.capabilities import refusals
from mbd.simulation.run.plain import MechanismSystem
from mbd.state import Mode, State
from mbd.testing.integrators import observed_order
from mbd.testing.problems import PROBLEMS, problem
from tests.instances import INTEGRATORS
from tests.integrators.own import ProjectedMidpoint

FACTORS = [(0.0, 0.0), (0.0, 0.7), (0.3, 0.0), (0.3, 0.7), (1e-3, 1e-6), (-0.2, 0.5), (2.0, -1.0)]
"""(c_C, c_K), zeros and negative ones among them."""


# the tangent --------------------------------------------------------------------------------------------------------
def differences(system, point, mode, name, part, size=1e-6):
    """∂(part of the terms)/∂(name of the point) by central differences."""
    at = getattr(point, name)
    columns = []
    for k in range(len(at)):
        step = np.zeros(len(at))
        step[k] = size
        ends = (getattr(system.evaluate(replace(point, **{name: at + s * step}), mode, None), part) for s in (1, -1))
        columns.append((next(ends) - next(ends)) / (2.0 * size))
    return np.array(columns).T.reshape(len(getattr(system.evaluate(point, mode, None), part)), len(at))


def assert_tangent_of_residual(system, point, mode, stabilized):
    dr = {name: differences(system, point, mode, name, "r") for name in ("rate", "y", "x", "lam")}
    n, n_v = len(point.y), len(point.x)
    stiff = np.hstack([dr["x"], np.zeros((n, n - n_v))])
    near = {"rtol": 2e-6, "atol": 2e-6 * max(1.0, *(np.abs(each).max(initial=0.0) for each in dr.values()))}
    for c_C, c_K in FACTORS:
        terms = system.evaluate(point, mode, (c_C, c_K))
        said = f"(c_C, c_K) = ({c_C:g}, {c_K:g})"
        np.testing.assert_allclose(terms.S, dr["rate"] + c_C * dr["y"] + c_K * stiff, **near, err_msg=f"S at {said}")
        if not len(terms.h):
            continue
        np.testing.assert_allclose(terms.R, dr["lam"], **near, err_msg=f"R at {said}")
        fast = np.zeros(len(terms.h), bool) if terms.velocity is None else terms.velocity
        B = differences(system, point, mode, "x", "h")
        if stabilized or fast.any():
            level = (stabilized | fast)[:, None]
            turning = differences(system, point, mode, "x", "rate")
            B = np.where(level, differences(system, point, mode, "y", "rate")[:, :n_v], B)
            B = B + np.where(level & (c_C != 0.0), (c_K / (c_C or 1.0)) * turning, 0.0)
        np.testing.assert_allclose(np.asarray(terms.H)[:, :n_v], B, **near, err_msg=f"H at {said}")
        assert not np.asarray(terms.H)[:, n_v:].any()


@pytest.mark.parametrize(("name", "stabilized"), list(itertools.product(PROBLEMS, (True, False))))
def test_the_tangent_of_a_problem_is_the_derivative_of_its_residual(name, stabilized):
    posed, rng = problem(name, stabilized), np.random.default_rng(3)
    n, n_v = len(posed.start.v) + len(posed.start.z), len(posed.start.v)
    random = (rng.normal(size=k) for k in (n_v, n_v, n, n, posed.rows))
    assert_tangent_of_residual(posed.system, Point(0.4, *random), Mode(), stabilized)


def skewed(u, w, a):
    """A row on velocities."""
    return u - mbd.sin(a) * w


def scene():
    """A block on a rough floor with a mat, a loop, a row on velocities, a spring, a loss and a motor with a state."""
    model = mbd.Model("scene")
    block, rod = mbd.RigidBody("block", 2.0, (0.1, 0.1, 0.2)), mbd.Link("rod", 1.0, 0.8, 0.3, inertia=0.1)
    pin = mbd.Revolute("pin", block.origin, rod.start, loss=mbd.Quadratic(0.4), stiffness=3.0)
    model.connect(mbd.Planar("float", model.ground.origin, block.origin), pin)
    model.apply(mbd.Spring("spring", model.ground.point(1, 1), rod.end, 40.0, 0.5))
    model.constrain(
        mbd.Bilateral("wire", mbd.distance(model.ground.point(0.0, 2.0), rod.end), value=1.5),
        mbd.Nonholonomic("row", skewed, arguments=("float.x.rate", "pin.rate", "pin.angle")),
        mbd.Unilateral("floor", mbd.touchdown(block.point(0.1, -0.1)), friction=0.4),
        mbd.Penalty("mat", mbd.height(rod.end), stiffness=300.0, damping=2.0, exponent=1.5),
    )
    return model


@pytest.mark.parametrize(
    ("stabilized", "closed"), list(itertools.product((True, False), ([], ["floor"], ["floor", "mat"])))
)
def test_the_tangent_of_a_mechanism_is_the_derivative_of_its_residual(stabilized, closed):
    mechanism = mechanism_of(scene())
    manager, layout = ActiveSetManager(mechanism.equations), mechanism.layout
    values, rng = mechanism.parameters({}), np.random.default_rng(5)
    dropped = np.zeros(layout.n_rows, dtype=np.int64)
    sticks, slip = np.zeros(layout.n_frictions, dtype=np.int64), np.full(layout.n_frictions, float("floor" in closed))
    anchors = rng.normal(size=mechanism.equations.n_anchors)
    system = MechanismSystem(mechanism, manager, values, anchors, stabilized, dropped, sticks, slip)
    mode = Mode(frozenset(closed))
    sizes = (layout.n_q, layout.n_v, layout.n, layout.n, len(system.active(mode)[0]))
    assert_tangent_of_residual(system, Point(0.3, *(0.3 * rng.normal(size=k) for k in sizes)), mode, stabilized)


# a user's own systems -----------------------------------------------------------------------------------------------
class Swing(System):
    """``v̇ + sin q = 0``, in as few lines as a user writes it."""

    def evaluate(self, point, mode, tangent):
        q = point.q + point.x
        return Terms(point.rate + np.sin(q), np.diag(1.0 + (tangent or (0.0, 0.0))[1] * np.cos(q)))


class Bare:
    """The same, of no base."""

    evaluate = Swing.evaluate


J, CENTER = np.array([1.0, 1.4, 0.7]), np.array([0.3, -0.2, 0.5])


def product(p, q):
    """Of quaternions (w, x, y, z)."""
    (a, x, y, z), (b, u, v, w) = p, q
    return np.array([a * b - x * u - y * v - z * w, a * u + x * b + y * w - z * v,
                     a * v - x * w + y * b + z * u, a * w + x * v - y * u + z * b])  # fmt: skip


def cross(a, b):
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def torque(q):
    """Of the weight, in axes of the body."""
    down = product(product(q * [1, -1, -1, -1], [0.0, 0.0, 0.0, -9.81]), q)[1:]
    return cross(CENTER, down)


class Top(System):
    """A heavy body that turns about a point: four coordinates (a quaternion), three velocities in its own axes."""

    constant_mass = True

    def evaluate(self, point, mode, tangent):
        w, here = point.y, self.compose(point.q, point.x)
        r = J * point.rate + cross(w, J * w) - torque(here)
        if tangent is None:
            return Terms(r)
        axes = np.eye(3)
        C = np.array([cross(e, J * w) + cross(w, J * e) for e in axes]).T
        K = -np.array([torque(self.compose(here, 1e-6 * e)) - torque(self.compose(here, -1e-6 * e)) for e in axes]).T
        return Terms(r, np.diag(J) + tangent[0] * C + tangent[1] * K / 2e-6)

    def compose(self, q, x):
        angle = np.sqrt(x @ x)
        return product(q, np.array([np.cos(angle / 2), *(0.5 * np.sinc(angle / (2 * np.pi)) * x)]))


class ChartedTop(Top):
    """The same, which tells how increments move anywhere in a chart."""

    def increment_rates(self, x, v):
        angle = np.sqrt(x @ x)
        part = 1.0 / 12.0 if angle < 1e-3 else (1.0 - 0.5 * angle / np.tan(0.5 * angle)) / angle**2
        return v + 0.5 * cross(x, v) + part * cross(x, cross(x, v))


def end_of_top(start, duration):
    def slope(t, y):
        q, w = y[:4], y[4:]
        return np.concatenate([0.5 * product(q, [0.0, *w]), (torque(q) - cross(w, J * w)) / J])

    y0 = np.concatenate([start.q, start.v])
    return solve_ivp(slope, (0.0, duration), y0, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]


def steps(scheme, system, start, dt, count):
    state, memory = start, scheme.start(system, start, Mode(), dt)
    for _ in range(count):
        result = scheme.step(system, state, dt, Mode(), memory)
        assert result.report.converged, result.report.message
        state, memory = result.state, result.memory
    return np.concatenate([state.q, state.v])


@pytest.mark.parametrize("scheme", [*INTEGRATORS, ProjectedMidpoint()], ids=repr)
@pytest.mark.parametrize("system", [Swing(), Bare()], ids=["inherits", "bare"])
def test_a_class_with_an_evaluate_alone_runs_through_every_scheme(scheme, system):
    start = State(0.0, np.array([1.0]), np.array([0.3]))
    exact = solve_ivp(lambda t, y: [y[1], -np.sin(y[0])], (0.0, 1.0), [1.0, 0.3], "DOP853", rtol=1e-12, atol=1e-13)
    end = steps(scheme, system, start, 0.02, 50)
    assert np.abs(end - exact.y[:, -1]).max() < (0.1 if scheme.order(system) == 1 else 2e-3)


@pytest.mark.covering
@pytest.mark.parametrize("scheme", INTEGRATORS, ids=repr)
@pytest.mark.parametrize("system", [Top(), ChartedTop()], ids=["centre", "charts"])
def test_where_positions_turn_a_scheme_has_the_order_that_it_tells(scheme, system):
    start = State(0.0, np.array([1.0, 0.0, 0.0, 0.0]), np.array([2.0, -3.0, 1.5]))
    exact = end_of_top(start, 0.8)
    counts = (3, 6, 12) if scheme.order(system) == 8 else (20, 40, 80)
    errors = [np.abs(steps(scheme, system, start, 0.8 / count, count) - exact).max() for count in counts]
    assert observed_order(errors, 1e-11) == pytest.approx(scheme.order(system), abs=0.15)


def test_constancy_of_the_mass_decides_on_the_order_of_the_averaged_form():
    scheme = mbd.HHT(0.1, form="averaged")
    assert [scheme.order(each) for each in (None, Swing(), Bare())] == [1, 1, 1]
    assert scheme.order(problem("driven pendulum").system) == 2


def test_rows_without_accelerations_of_the_system_are_an_error_that_says_what_to_give():
    class Rodless(System):
        def evaluate(self, point, mode, tangent):
            return Terms(point.rate, np.eye(2), h=np.array([point.q[0]]))

    with pytest.raises(mbd.CapabilityError, match=r"Rodless.*accelerations\(t, q, y, mode\)"):
        consistent_rates(Rodless(), 0.0, np.zeros(2), np.zeros(2), Mode())


def test_a_scheme_that_does_not_say_that_it_moves_in_any_chart_is_refused_where_positions_turn():
    equations = mechanism_of(scene()).equations
    turning = replace(equations, compose=tuple(equations.tape.input("q", k) for k in range(equations.n_q)))
    assert not refusals(equations, ProjectedMidpoint(), {})
    assert "q + x" in refusals(turning, ProjectedMidpoint(), {})[0]
    assert not any(refusals(turning, scheme, {}) for scheme in (mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta853()))
