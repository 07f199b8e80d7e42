"""Laws of motion in space over random trees and loops of every joint: energy, momentum, one motion for every cut."""

import random
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

import mbd
from mbd.joints.quaternions import rotation_of
from mbd.testing.mechanisms import random_body, random_frame

SEEDS = st.integers(0, 10**6)
few = settings(max_examples=1, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
many = settings(max_examples=30, deadline=None, suppress_health_check=list(HealthCheck))
KINDS: list[Any] = [
    lambda *given: mbd.Spherical(*given), lambda *given: mbd.Spherical(*given, stiffness=3.0),
    lambda *given: mbd.Revolute(*given, axis=(1, 2, 3)), lambda *given: mbd.Universal(*given),
    lambda *given: mbd.Cylindrical(*given), lambda *given: mbd.Screw(*given, pitch=0.3),
    lambda *given: mbd.Prismatic(*given, axis=(1, -1, 2)), lambda *given: mbd.Weld(*given),
]  # fmt: skip


def chain(seed: int, bodies: int, floating: bool, cut: Any = "auto", closed: Any = None) -> mbd.Model:
    """Bodies one behind the other, some joints described from the far side; the last may be held at a point.

    closed : place of the ground at which the last body turns freely about its point 'end'
    """
    rng = random.Random(seed)
    gravity = (0.0, 0.0, 0.0) if floating else tuple(rng.uniform(-8, 8) for _ in range(3))
    model = mbd.Model(f"chain {seed}", gravity=gravity, cut=cut)
    known: list[Any] = [model.ground]
    for k in range(bodies):
        body = random_body(rng, f"body {k}", True)
        a, b = random_frame(rng, known[-1], True, 0.5), random_frame(rng, body, True, 0.5)
        back = rng.random() < 0.3 and k > 0
        kind = (lambda *given: mbd.Free(*given)) if floating and k == 0 else rng.choice(KINDS[: 2 if k == 1 else None])
        model.connect(kind(f"joint {k}", *((b, a) if back else (a, b))))
        known.append(body)
    end = known[-1].point(0.3, -0.4, 0.2, name="end")
    if closed is not None:
        model.connect(mbd.Spherical("closing", model.ground.point(*map(float, closed)), end))
    return model


def pose(model: mbd.Model, seed: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """Random values of every coordinate and velocity of the joints of a chain."""
    chance = np.random.default_rng(seed)
    position: dict[str, Any] = {}
    velocity: dict[str, Any] = {}
    for joint in model.joints:
        if joint.name == "closing":
            continue
        for label in joint.labels[: joint.adding]:
            position[f"{joint.name}.{label.name}"] = chance.uniform(-0.6, 0.6)
        if joint.orientation is not None:
            q = chance.normal(size=4)
            q[0] += 4.0 * joint.stiffness  # a spring stays far from half a turn
            position[f"{joint.name}.orientation"] = q / np.linalg.norm(q)
        velocity |= {name: chance.uniform(-2.0, 2.0) for name in joint.velocity_names}
    return position, velocity


def momentum(run: mbd.Trajectory, bodies: int) -> Any:
    """Linear momentum (R, 3)."""
    masses = [run.parameters[f"body {k}.mass"] for k in range(bodies)]
    return sum(
        mass * np.column_stack([run[f"body {k}.center.v{axis}"] for axis in "xyz"]) for k, mass in enumerate(masses)
    )


def moment(run: mbd.Trajectory, model: mbd.Model, row: int) -> Any:
    """Angular momentum about the origin of the ground at a row, on whose first joint the mechanism floats.

    Kinetic energy is a quadratic form, so that the momentum of a turn u of everything is ½ (T(v + u) − T(v − u)).
    """
    state = replace(run.final, q=run.record.q[row], v=run.record.v[row], memory=None)
    names = list(state.velocity_names)
    place = np.array([state[f"joint 0.{axis}"] for axis in "xyz"])
    R = np.array(rotation_of(state["joint 0.orientation"]))

    def energy(omega: Any) -> float:
        v = np.array(state.v)
        v[[names.index(f"joint 0.{axis}.rate") for axis in "xyz"]] += np.cross(omega, place)
        v[[names.index(f"joint 0.angular_velocity.{axis}") for axis in "xyz"]] += R.T @ omega
        moved = mbd.simulate(model, replace(state, v=v), mbd.RungeKutta853(), dt=0.01, until=state.time)
        return float(moved.energy.kinetic[0])

    return np.array([0.5 * (energy(axis) - energy(-axis)) for axis in np.eye(3)])


def energy_and_momentum(seed: int) -> None:
    model = chain(seed, 3, floating=True)
    run = mbd.simulate(model, mbd.assemble(model, *pose(model, seed)), mbd.RungeKutta853(), dt=2e-3, until=0.2)
    size = float(run.energy.kinetic[0])
    assert np.max(np.abs(run.energy.numerical)) < 1e-9 * size
    linear = momentum(run, 3)
    assert np.max(np.abs(linear - linear[0])) < 1e-9 * size
    np.testing.assert_allclose(moment(run, model, -1), moment(run, model, 0), atol=1e-8 * size)


def one_motion(seed: int, loop: bool) -> None:
    """The same end of a chain, the same reaction of its first joint, however it is cut."""
    bodies = 4 if loop else 3
    open_ = chain(seed, bodies, floating=False)
    position, velocity = pose(open_, seed)
    start = mbd.assemble(open_, position, velocity)
    closed = None
    if loop:
        closed = mbd.simulate(open_, start, mbd.RungeKutta853(), dt=0.01, until=0.0)[f"body {bodies - 1}.end"][0]
    first = chain(seed, bodies, floating=False, closed=closed)
    begun = mbd.assemble(first, position)
    found = []
    for cut in ("auto", "all", ("joint 1",)):
        model = chain(seed, bodies, floating=False, cut=cut, closed=closed)
        if loop:  # at rest, which every choice of coordinates names alike
            own = mbd.assemble(model, position)
        else:
            own = mbd.assemble(model, position, velocity)
        run = mbd.simulate(model, own, mbd.RungeKutta853(), dt=2e-3, until=0.1)
        assert run.violation.length < 1e-10
        size = 1.0 + float(np.max(run.energy.kinetic))
        assert np.max(np.abs(run.energy.numerical)) < 1e-8 * size
        assert mbd.mobility(model, own).dof == mbd.mobility(first, begun).dof
        names = (f"body {bodies - 1}.end", "body 1.center", "joint 0.reaction_force", "joint 1.reaction_force")
        found.append(np.concatenate([run[name][-1] for name in names]))
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], atol=1e-6 * (1.0 + np.max(np.abs(found[0]))))


@few
@given(SEEDS)
def test_floating_chains_keep_energy_and_both_momenta(seed: int) -> None:
    energy_and_momentum(seed)


@pytest.mark.slow
@many
@given(SEEDS)
def test_more_floating_chains_keep_energy_and_both_momenta(seed: int) -> None:
    energy_and_momentum(seed)


@pytest.mark.slow
@many
@given(SEEDS)
def test_chains_in_space_move_alike_however_they_are_cut(seed: int) -> None:
    one_motion(seed, loop=False)


@pytest.mark.slow
@many
@given(SEEDS)
def test_loops_in_space_move_alike_however_they_are_cut(seed: int) -> None:
    one_motion(seed, loop=True)


@pytest.mark.filterwarnings("ignore:'ball spring' was turned")
def test_a_spring_beyond_half_a_turn_puts_the_run_in_doubt() -> None:
    model = mbd.Model("wound up", gravity=(0.0, 0.0, 0.0))
    body = mbd.RigidBody("body", 1.0, (0.2, 0.3, 0.4))
    model.connect(mbd.Spherical("ball", model.ground.origin, body.origin, stiffness=1.0))
    for speed, over in ((1.0, False), (8.0, True)):
        start = mbd.assemble(model, velocity={"ball.angular_velocity": (0.0, 0.0, speed)})
        run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.6)
        found = [note for note in run.stats["notes"] if "'ball spring' was turned beyond half a turn" in note]
        assert len(found) == over
