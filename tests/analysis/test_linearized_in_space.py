"""Linear motions in space: the same whichever joints are cut or turned round, and however the world lies."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mbd
from tests.fuzz.structures import SPACE, structure

JOINTS = ("spherical", "universal", "revolute", "cylindrical", "free of place")


def turned(frame: Any, rotation: Rotation) -> Any:
    """A frame with its axes turned."""
    vector = rotation.as_rotvec()
    angle = float(np.linalg.norm(vector))
    return frame if angle == 0.0 else frame.turned(angle, tuple(vector / angle))


def hanging(seed: int, world: Rotation, cut: Any = "auto", reverse: bool = False, order: int = 1) -> mbd.Model:
    """Two to four bodies that hang from each other at rest, by joints of all kinds with springs and losses.

    At zero all joints' frames are parallel to a ground that is turned by `world`, and every center of mass hangs below.
    """
    chance = np.random.default_rng(seed)
    model = mbd.Model("hanging", gravity=tuple(world.apply([0.0, -9.81, 0.0])), cut=cut)
    anchor, place, joints, spring = turned(model.ground.origin, world), np.zeros(3), [], mbd.Viscous(0.05)
    for k in range(2 + seed % 3):
        own = Rotation.random(random_state=chance)  # of the body's axes, against the frames
        drop, length = chance.uniform(0.1, 0.4), chance.uniform(0.4, 0.7)
        axes = np.diag(0.016 + 0.01 * chance.uniform(size=3)) + 0.001 * np.ones((3, 3))
        inertia = own.inv().as_matrix() @ axes @ own.as_matrix()
        center = own.inv().apply([0.0, -drop, 0.0])
        full = tuple(map(tuple, 0.5 * (inertia + inertia.T)))
        body = mbd.RigidBody(f"body {k}", chance.uniform(0.5, 2.0), full, tuple(center))
        top = turned(body.origin, own.inv())
        kind, name = JOINTS[int(chance.integers(len(JOINTS)))], f"joint {k}"
        pair = (top, anchor) if reverse else (anchor, top)
        if kind == "spherical":
            joints.append(mbd.Spherical(name, *pair, stiffness=3.0, loss=spring))
        elif kind == "universal":
            joints.append(mbd.Universal(name, *pair, axis=(1, 0, 0), second_axis=(0, 0, 1)))
        elif kind == "revolute":
            joints.append(mbd.Revolute(name, *pair, axis=(1, 0, 0), loss=spring))
        elif kind == "cylindrical":
            joints.append(mbd.Cylindrical(name, *pair, axis=(0, 0, 1)))
            model.apply(mbd.Bushing(f"bushing {k}", anchor, top, (40.0, 40.0, 40.0), (1.0, 1.0, 1.0)))
        else:
            joints.append(mbd.Spherical(name, *pair, stiffness=2.0))
        anchor = turned(body.point(*own.inv().apply([0.0, -length, 0.0])), own.inv())
        place = place - [0.0, length, 0.0]
    model.connect(*joints[::order])
    return model


def eigenvalues(model: mbd.Model, start: mbd.State | None = None) -> Any:
    return np.asarray(mbd.linearize(model, start or mbd.assemble(model)).eigenvalues)


def apart(first: Any, second: Any) -> float:
    """The largest distance of one from the nearest of the others, over the largest."""
    gaps = np.abs(first[:, None] - second[None, :])
    return float(max(gaps.min(axis=0).max(), gaps.min(axis=1).max()) / np.abs(first).max())


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 60))])
def test_modes_at_rest_are_the_same_in_every_description(seed):
    here, away = Rotation.identity(), Rotation.random(random_state=seed)
    found = eigenvalues(hanging(seed, here))
    names = [joint.name for joint in hanging(seed, here).joints]
    others = [
        hanging(seed, here, cut="all"), hanging(seed, here, cut=[names[-1]]), hanging(seed, here, reverse=True),
        hanging(seed, here, order=-1), hanging(seed, away), hanging(seed, away, cut="all", reverse=True),
    ]  # fmt: skip
    for model in others:
        assert len(found) == len(other := eigenvalues(model))
        assert apart(found, other) < 1e-6


@pytest.mark.parametrize("seed", range(2))
def test_small_motions_are_those_of_the_linear_equations(seed):
    """The largest difference from the linear motion falls with the square of the amplitude."""
    model = hanging(seed, Rotation.identity())
    rest = mbd.assemble(model)
    linear = mbd.linearize(model, rest)
    rates = mbd.simulate(model, rest, dt=1e-3, until=1e-3).record.equations.velocity_names
    chance = np.random.default_rng(seed).normal(size=len(rates))
    misses = []
    for size in 1e-2, 5e-3:
        start = mbd.assemble(model, velocity=dict(zip(rates, size * chance, strict=True)))
        run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=5e-3, until=0.4)
        values, vectors = np.linalg.eig(linear.A)
        begin = np.concatenate([np.zeros(len(rates)), size * chance])
        end = (vectors * np.exp(0.4 * values)) @ np.linalg.solve(vectors, begin)
        misses.append(np.max(np.abs(run.record.v[-1] - end.real[len(rates) :])))
    assert misses[1] < 0.3 * misses[0] < 1e-3


@pytest.mark.parametrize("number", [SPACE + 2, SPACE + 10, SPACE + 26])
def test_a_loop_in_a_tilted_plane_has_linear_motions(number):
    """Rows that depend on each other everywhere: what is left of their second derivatives is round-off."""
    form = structure(number)
    start = mbd.assemble(form.model, form.position, project=True)
    assert len(eigenvalues(form.model, start)) == 2
