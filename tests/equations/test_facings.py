"""Cut joints in space are put together as described, never half a turn off."""

import random
from dataclasses import replace

import numpy as np
import pytest

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.results.columns import ModelColumns
from mbd.results.violation import violation
from mbd.simulation.run.stored import whole_record
from tests.forward_kinematics import beyond, misfit, placed, poses, relative

KINDS = ["Weld", "Prismatic", "Revolute", "Cylindrical", "Translation", "Screw", "Universal"]


def joint(rng, kind, name, a, b):
    axis = tuple(rng.uniform(-1, 1) for _ in range(3))
    return {
        "Weld": lambda: mbd.Weld(name, a, b),
        "Prismatic": lambda: mbd.Prismatic(name, a, b, axis=axis),
        "Revolute": lambda: mbd.Revolute(name, a, b, axis=axis),
        "Cylindrical": lambda: mbd.Cylindrical(name, a, b, axis=axis),
        "Translation": lambda: mbd.Translation(name, a, b, axes=rng.choice(["x", "xy", "xyz"])),
        "Screw": lambda: mbd.Screw(name, a, b, pitch=0.3, axis=axis),
        "Universal": lambda: mbd.Universal(name, a, b),
    }[kind]()


def kind_of(rng, k):
    return "Revolute" if k < 5 else rng.choice(KINDS[2:4])


def frame(rng, body):
    point = body.point(*(rng.uniform(-0.5, 0.5) for _ in range(3)))
    return point.turned(rng.uniform(-3.0, 3.0), tuple(rng.uniform(-1, 1) for _ in range(3)))


def loop(seed, kind=None):
    """A chain of hinges and a sleeve, closed by a joint of any kind where it is, and the coordinates of all joints."""
    rng = random.Random(seed)
    model = mbd.Model(f"spatial loop {seed}", gravity=(0.0, -9.81, 0.0))
    tree, values, before = [], {}, model.ground
    for k in range(7):
        body = mbd.RigidBody(f"body {k}", mass=1.0, inertia=(0.2, 0.3, 0.25))
        made = joint(rng, kind_of(rng, k), f"j{k}", frame(rng, before), frame(rng, body))
        values |= {name: rng.uniform(-3.0, 3.0) * (0.2 if "disp" in name else 1.0) for name in made.coordinate_names}
        tree.append(made)
        before = body
    R, p = poses(model, tree, values.__getitem__)[before.name]
    b = frame(rng, before)
    closing = joint(rng, kind or rng.choice(KINDS), "closing", model.ground.origin, b)
    own = {label.name: rng.uniform(-1.0, 1.0) for label in closing.labels}
    values |= {f"closing.{name}": value for name, value in own.items()}
    (C, c), (J, j) = placed(b), relative(closing, own)
    axes = R @ C @ J.T
    place = p + R @ c - axes @ j
    closing = type(closing)(**{**vars(closing), "parent": oriented(model.ground.point(*place), axes)})
    model.connect(*tree, closing)
    return model, values


def oriented(point, R):
    """A frame at a point with given axes."""
    angle = float(np.arccos(np.clip((np.trace(R) - 1.0) / 2.0, -1.0, 1.0)))
    axial = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return point.turned(angle, tuple(axial / np.linalg.norm(axial)))


def off(model, start):
    """How far the joints are from their bodies, walking the tree in numpy; the closing one by the run's own angles."""
    run = mbd.simulate(model, start, mbd.HHT(), dt=1e-6, until=1e-6, backend="python")
    *tree, closing = model.joints
    found = poses(model, tree, lambda name: run[name][0])
    own = {label.name: run[f"closing.{label.name}"][0] for label in closing.labels}
    return misfit(closing, found, own), run.violation


HALF = np.array([np.pi, 0.0])

QUICK = {"Weld": 2, "Prismatic": 0, "Screw": 2}
"""Loops that a search with plain sines puts together the wrong way round."""


@pytest.mark.parametrize(
    ("kind", "seed"),
    [*QUICK.items(), *(pytest.param(kind, seed, marks=pytest.mark.slow) for kind in KINDS for seed in range(4))],
)
def test_a_loop_with_one_named_coordinate_closes_the_right_way_round(kind, seed):
    model, values = loop(seed, kind)
    name = "j0.angle"
    start = mbd.assemble(model, position={name: values[name]}, backend="python")
    (turned, shifted), violated = off(model, start)
    assert max(turned, shifted) < 1e-7 and max(violated.angle, violated.length) < 1e-8
    assert start[name] == values[name]


def test_a_weld_half_a_turn_off_is_told_by_the_violation_and_refused_as_a_start():
    """A spatial chain that ends in a weld; its last hinge turned by π satisfies every row."""
    model = mbd.Model("weld", gravity=(0.0, 0.0, 0.0), cut=["weld"])
    a, b = (mbd.RigidBody(name, mass=1.0, inertia=(0.2, 0.3, 0.25)) for name in "ab")
    model.connect(
        mbd.Revolute("first", model.ground.origin, a.origin, axis=(1.0, 0.0, 0.0)),
        mbd.Revolute("second", a.origin, b.origin, axis=(1.0, 0.0, 0.0)),
        mbd.Weld("weld", model.ground.origin, b.origin),
    )
    start = mbd.assemble(model, backend="python")
    turned = replace(start, q=start.q + HALF)
    with pytest.raises(mbd.ModelError, match="'weld' is put together the wrong way round"):
        mbd.simulate(model, turned, dt=1e-3, until=0.1, backend="python")
    with pytest.raises(mbd.AssemblyError, match="'weld' is put together the wrong way round"):
        mbd.project(model, turned, backend="python")
    run = mbd.simulate(model, start, dt=1e-3, until=1e-3, backend="python")
    columns = ModelColumns(replace(run.record, q=run.record.q + HALF), mechanism_of(model, "python").equations)
    assert violation(columns).angle == pytest.approx(np.pi) and violation(columns).worst == "weld"


def test_a_run_that_is_the_wrong_way_round_for_a_while_only_is_refused(monkeypatch):
    """A long step may turn a joint over, and another one back: every stored row is looked at."""
    model = mbd.Model("slide", gravity=(0.0, 0.0, 0.0), cut=["slide"])
    a, b = (mbd.RigidBody(name, mass=1.0, inertia=(0.2, 0.3, 0.25)) for name in "ab")
    model.connect(
        mbd.Cylindrical("first", model.ground.origin, a.origin, axis=(1.0, 0.0, 0.0)),
        mbd.Revolute("second", a.origin, b.origin, axis=(1.0, 0.0, 0.0)),
        mbd.Prismatic("slide", model.ground.origin, b.origin),
    )
    start = mbd.assemble(model, velocity={"first.displacement": 1.0, "first.angle": 0.5})
    settings = {"dt": 1e-2, "until": 0.1, "backend": "python"}
    assert mbd.simulate(model, start, **settings).success

    def turned_over(run):
        record = whole_record(run)
        q = record.q.copy()
        q[4:6, start.names.index("second.angle")] += np.pi
        return replace(record, q=q)

    monkeypatch.setattr("mbd.simulation.marching.whole_record", turned_over)
    with pytest.raises(mbd.SimulationError, match=r"t = 0\.04 s: 'slide' was turned by half a turn"):
        mbd.simulate(model, start, **settings)


@pytest.mark.parametrize("cut", [["hinge"], "all"], ids=str)
@pytest.mark.parametrize("angle", [-2.34, 2.9])
def test_an_angle_that_is_a_coordinate_of_its_own_is_the_one_that_its_bodies_show(cut, angle):
    """A loop of two ball joints and a hinge, whose angle its spring knows by a row that holds a sine."""
    model = mbd.Model("ball, hinge, ball", cut=cut)
    a, b = (mbd.RigidBody(name, 1.0, (0.2, 0.3, 0.25)) for name in "ab")
    hinge = mbd.Revolute("hinge", a.point(0.5, 0.1, 0.0), b.point(-0.4, 0.0, 0.1), axis=(0.2, 0.3, 1.0), stiffness=3.0)
    R, p = beyond(hinge, (np.eye(3), np.zeros(3)), {"angle": angle})
    model.connect(
        mbd.Spherical("left", model.ground.origin, a.origin), hinge,
        mbd.Spherical("right", model.ground.point(*p), b.origin),
    )  # fmt: skip
    named = {"left.orientation": (1.0, 0.0, 0.0, 0.0), "right.orientation": R, "hinge.angle": angle}
    start = mbd.assemble(model, named, {"left.angular_velocity": (0.3, 0.2, 0.1)}, project=True)
    run = mbd.simulate(model, start, dt=1e-3, until=2e-3)
    assert run["hinge.angle"][0] == pytest.approx(angle, abs=1e-9)
    assert run["hinge.angle"] == pytest.approx(angle, abs=0.1)
    guessed = mbd.assemble(model, {name: named[name] for name in ("left.orientation", "right.orientation")})
    assert np.cos(guessed["hinge.angle"] - angle) == pytest.approx(1.0)
