"""Small motions: exact derivatives, natural frequencies in closed form, independence of cut and order."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.assembly.pose import Posture
from mbd.assembly.posture import close_nearby, close_velocities, position_rows
from mbd.compile.mechanisms import mechanism_of
from mbd.integrators.base import Point
from mbd.kernel.contact.active_set import ActiveSetManager
from tests.cases.linkages import parallel_cranks
from tests.cases.small_motions import PLAIN, at_rest, four_bar, moving, pendulums


# derivatives ------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("cut", ["auto", "all"])
def test_matrices_are_the_differences_of_the_balance(cut):
    model, state = moving(cut)
    found = mbd.linearize(model, state, backend=PLAIN)
    system, rate = found.instant.system, found.instant.rate
    lam = found.instant.lam[list(found.instant.rows)]

    def terms(x=0.0, v=0.0, a=0.0):
        zero = np.zeros(len(state.v))
        return system.evaluate(Point(0.0, state.q, zero + x, state.v + v, rate + a, lam), state.mode, None)

    def differences(what, pick, step=1e-6):
        columns = []
        for unit in np.eye(len(state.v)):
            columns.append((pick(terms(**{what: step * unit})) - pick(terms(**{what: -step * unit}))) / (2 * step))
        return np.array(columns).T

    assert np.max(np.abs(terms().r)) < 1e-10
    for matrix, what in (found.M, "a"), (found.damping_matrix, "v"), (found.K, "x"):
        assert matrix == pytest.approx(differences(what, lambda each: each.r), abs=1e-6)
    assert pytest.approx(differences("x", lambda each: each.h), abs=1e-8) == found.constraint_jacobian
    assert np.max(np.abs(found.damping_matrix)) > 0.1 and np.max(np.abs(found.K - found.K.T)) > 1e-3  # M v̇ is part of K


@pytest.mark.parametrize("cut", ["auto", "all", ["b"]])
def test_the_state_matrix_is_the_jacobian_of_the_independent_motion_at_any_state(cut):
    """Differences over states closed nearby from the independent values, with accelerations solved for there."""
    model, state = moving(cut)
    found = mbd.linearize(model, state, backend=PLAIN)
    places = [name for name in found.states if name in state.names]
    assert len(found.states) == 2 and not found.is_equilibrium

    mechanism = mechanism_of(model, PLAIN)
    manager, place = ActiveSetManager(mechanism.equations), state.names.index(places[0])
    free = np.arange(len(state.q)) != place

    def rate(x):
        q, v = state.q.copy(), state.v.copy()
        q[place], v[place] = x
        near = Posture(mechanism, manager, mechanism.parameters(), q, v, manager.flags(()), state.anchors.copy())
        assert np.max(np.abs(close_nearby(near, position_rows(near), free)), initial=0.0) < 1e-12
        close_velocities(near, free)
        return found.rhs(0.0, np.concatenate([near.q, near.y]))[list(found.picked)]

    step, columns = 1e-5, []
    for unit in np.eye(2):
        columns.append((rate(found.x + step * unit) - rate(found.x - step * unit)) / (2 * step))
    assert pytest.approx(np.array(columns).T, abs=1e-5 * np.max(np.abs(found.A))) == found.A


def test_dependent_coordinates_follow_the_basis():
    model, state = moving("all")
    found = mbd.linearize(model, state, backend=PLAIN)
    n = len(found.coordinates)
    assert np.max(np.abs(found.constraint_jacobian @ found.basis[:n])) < 1e-12
    assert found.basis[list(found.picked)] == pytest.approx(np.eye(len(found.states)))


# frequencies in closed form ---------------------------------------------------------------------------------------
@given(st.floats(0.2, 3.0), st.floats(0.1, 5.0), st.floats(0.0, 0.5))
@settings(max_examples=8)
def test_a_damped_pendulum_has_its_frequency_and_damping_ratio(length, mass, ratio):
    w = math.sqrt(9.81 / length)
    loss = mbd.Viscous(2 * ratio * w * mass * length**2)
    model = pendulums([mass], [length], loss=loss)
    (mode,) = mbd.linearize(model, mbd.assemble(model, backend=PLAIN), backend=PLAIN).modes
    assert mode.frequency == pytest.approx(w, rel=1e-12)
    assert mode.hertz == pytest.approx(w / (2 * math.pi), rel=1e-12)
    assert mode.damping_ratio == pytest.approx(ratio, abs=1e-12)
    assert mode.eigenvalue == pytest.approx(w * complex(-ratio, math.sqrt(1 - ratio**2)), rel=1e-10)


@pytest.mark.parametrize("cut", ["auto", "all", ["second pin"]])
def test_a_double_pendulum_has_its_frequencies_whatever_the_cut(cut):
    """ω⁴ m₁ L₁ L₂ − ω² g (m₁ + m₂)(L₁ + L₂) + g² (m₁ + m₂) = 0."""
    (m1, m2), (L1, L2), g = (1.3, 0.6), (0.8, 0.5), 9.81
    wanted = np.sqrt(np.sort(np.roots([m1 * L1 * L2, -g * (m1 + m2) * (L1 + L2), g * g * (m1 + m2)])))
    model = pendulums([m1, m2], [L1, L2], cut)
    found = mbd.linearize(model, mbd.assemble(model, backend=PLAIN), backend=PLAIN)
    assert [mode.frequency for mode in found.modes] == pytest.approx(wanted, rel=1e-11)
    assert np.max(np.abs(found.damping_ratios)) < 1e-10
    assert found.is_equilibrium and len(found.states) == 4


@pytest.mark.parametrize("count", [1, 4, 7])
def test_a_chain_of_springs_has_the_frequencies_and_shapes_of_its_closed_form(count):
    """Masses between two walls: ω_k = 2 √(c/m) sin(k π/(2 n + 2)), shapes sin(j k π/(n + 1))."""
    mass, stiffness = 0.7, 55.0
    model = mbd.Model("chain", gravity=(0.0, 0.0, 0.0))
    bodies = [mbd.PointMass(f"mass {j}", mass) for j in range(count)]
    last = model.ground.origin
    for j, body in enumerate(bodies):
        model.connect(mbd.Prismatic(f"slide {j}", model.ground.point(float(j + 1), 0.0, name=f"rail {j}"), body.origin))
        model.apply(mbd.Spring(f"spring {j}", last, body.origin, stiffness, 1.0))
        last = body.origin
    model.apply(mbd.Spring("last", last, model.ground.point(count + 1.0, 0.0, name="wall"), stiffness, 1.0))
    found = mbd.linearize(model, mbd.assemble(model, backend=PLAIN), backend=PLAIN)
    turns = np.arange(1, count + 1) * math.pi / (count + 1)
    assert [mode.frequency for mode in found.modes] == pytest.approx(
        2 * math.sqrt(stiffness / mass) * np.sin(turns / 2), rel=1e-10
    )
    for turn, mode in zip(turns, found.modes, strict=True):
        shape = np.sin(turn * np.arange(1, count + 1))
        came = np.array(list(mode.shape.values()))
        assert abs(came @ shape) == pytest.approx(np.linalg.norm(came) * np.linalg.norm(shape), rel=1e-9)


def test_the_stiffness_of_a_pendulum_in_x_and_y_comes_from_the_tension_of_its_rod():
    model = mbd.Lagrangian(
        "x and y",
        ["x", "y"],
        kinetic=lambda x_rate, y_rate: 1.5 * (x_rate**2 + y_rate**2),
        potential=lambda y: 3.0 * 9.81 * y,
        constraints={"rod": lambda x, y: (x**2 + y**2 - 0.49) / 2},
    )
    found = mbd.linearize(model, mbd.assemble(model, position={"y": -0.7}, backend=PLAIN), backend=PLAIN)
    assert pytest.approx(np.diag([3.0 * 9.81 / 0.7] * 2)) == found.K
    assert found.states == ("x", "x.rate")
    assert found.modes[0].frequency == pytest.approx(math.sqrt(9.81 / 0.7), rel=1e-12)


def test_an_upright_pendulum_falls_with_its_exponential():
    model = pendulums([1.0], [0.8])
    found = mbd.linearize(model, mbd.assemble(model, position={"first pin.angle": math.pi}, backend=PLAIN))
    w = math.sqrt(9.81 / 0.8)
    assert sorted(found.eigenvalues.real) == pytest.approx([-w, w], rel=1e-10)
    assert sorted(found.damping_ratios) == pytest.approx([-1.0, 1.0])
    assert "grows" in str(found)


# choices that do not matter ---------------------------------------------------------------------------------------
def test_eigenvalues_at_an_equilibrium_do_not_depend_on_the_cut_or_the_order_of_rows():
    """Mixed units, springs, dampers and reaction forces."""
    first = at_rest(four_bar(), mbd.assemble(four_bar(), position={"a.angle": 0.4}))
    found = []
    for cut, order in ("auto", (0, 1, 2, 3)), ("all", (0, 1, 2, 3)), ("all", (3, 1, 0, 2)), (["b"], (2, 3, 1, 0)):
        model = four_bar(cut, order)
        angles = {name: first[name] for name in ("a.angle", "b.angle", "d.angle")}
        state = mbd.assemble(model, position=angles, project=True, backend=PLAIN)
        found.append(mbd.linearize(model, state, backend=PLAIN))
        assert len(found[-1].states) == 2 and found[-1].is_equilibrium
    assert found[0].eigenvalues.real[0] < -1e-3 and found[0].eigenvalues.imag[0] > 1.0
    for other in found[1:]:
        assert other.eigenvalues == pytest.approx(found[0].eigenvalues, rel=1e-8)


@pytest.mark.parametrize("count", [2, 3, 5])
def test_redundant_cranks_do_not_change_the_frequency_of_a_parallelogram(count):
    """Uniform cranks of mass m and length L, a coupler of mass M: ω² = (n m/2 + M) g/((n m/3 + M) L)."""
    model = parallel_cranks(count)
    found = mbd.linearize(model, mbd.assemble(model, backend=PLAIN), backend=PLAIN)
    wanted = math.sqrt((0.5 * count + 2.0) * 9.81 / (count / 3 + 2.0))
    assert [mode.frequency for mode in found.modes] == pytest.approx([wanted], rel=1e-9)
    assert sum(found.instant.dependent) == count - 2


def test_a_state_is_wanted():
    with pytest.raises(mbd.ModelError, match="state must be a State from mbd.assemble"):
        mbd.linearize(mbd.Model("empty"), 3)


def test_a_pose_in_which_branches_meet_has_no_linear_motion():
    model = parallel_cranks(2)
    flat = {"base 0.angle": math.pi / 2, "base 1.angle": math.pi / 2}
    with pytest.raises(mbd.ModelError, match="loses rank|no accelerations"):
        mbd.linearize(model, mbd.assemble(model, position=flat, backend=PLAIN), backend=PLAIN)
