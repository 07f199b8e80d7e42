"""Grounds, wheels and blades of pictures are those of the run, live and from a file."""

from functools import cache
from typing import Any

import numpy as np
import pytest

import mbd
from mbd.tape.evaluate import evaluate, evaluate_arrays
from mbd.tape.node import BINARY, UNARY, Tape
from mbd.view.instants import Instants
from mbd.view.page import content
from mbd.view.scene import scene, upright
from tests.view.test_page import unpacked

RADIUS, COUNT = 0.2, 40


def waves(x, t):
    return 0.1 * mbd.sin(3.0 * x - 2.0 * t) + mbd.where(x < 0.3, 0.05, 0.0)


def bowl(x, z):
    return 0.4 * x * x + 0.2 * z * z


@cache
def tossed(ground, depth=0.0) -> mbd.Trajectory:
    """A point that falls on a ground, in gravity that is not straight down."""
    model = mbd.Model("tossed", gravity=mbd.on_slope(0.2))
    ball = mbd.PointMass("ball", mass=1.0)
    model.connect(mbd.Translation("free", model.ground.origin, ball.origin, axes="xyz" if depth else "xy"))
    friction = 0.0 if depth else 0.3
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(ball.origin, ground), friction=friction))
    start = {"free.y": 0.3} | ({"free.z": depth} if depth else {})
    return mbd.simulate(model, mbd.assemble(model, position=start, velocity={"free.x": 0.5}), dt=2e-3, until=0.6)


@cache
def rolled() -> mbd.Trajectory:
    """A wheel on a belt on a cart, pulled by a blade's body of no concern to it."""
    model = mbd.Model("rolled")
    cart, wheel = mbd.RigidBody("cart", mass=2.0, inertia=0.1), mbd.RigidBody("wheel", mass=1.0, inertia=0.02)
    model.connect(
        mbd.Prismatic("rail", model.ground.origin, cart.origin, axis="x"),
        mbd.Planar("free", model.ground.origin, wheel.origin),
    )
    deck = mbd.Plane(normal=(-0.1, 1.0, 0.0), frame=cart.origin, offset=0.1, velocity=(0.3, 0.03, 0.0))
    raised = mbd.Plane(deck.normal, 0.1 + RADIUS, cart.origin, deck.velocity)
    model.constrain(
        mbd.Bilateral("on it", mbd.touchdown(wheel.origin, raised)), mbd.Rolling("tyre", wheel.origin, RADIUS, deck)
    )
    start = mbd.assemble(model, position={"free.x": 0.1, "free.angle": 0.4}, velocity={"rail.displacement": 0.2})
    return mbd.simulate(model, start, dt=5e-3, until=0.6)


@cache
def sleigh() -> mbd.Trajectory:
    model = mbd.Model("sleigh", gravity=(0.0, 0.0, 0.0))
    body = mbd.RigidBody("sleigh", mass=1.0, inertia=0.2, center=(0.2, 0.0))
    model.connect(mbd.Planar("free", model.ground.origin, body.origin))
    model.constrain(mbd.KnifeEdge("blade", body.point(-0.1, 0.2, name="runner").turned(0.3), normal=(0.1, 1.0, 0.0)))
    start = mbd.assemble(model, velocity={"free.angle": 1.0})
    return mbd.simulate(model, start, dt=1e-2, until=1.0)


def rippled(x, z, t):
    return 0.2 * x * x + 0.1 * z + 0.05 * mbd.sin(3.0 * x - 2.0 * t)


def test_a_surface_in_space_is_on_the_page_as_it_moves(tmp_path):
    """Corners p + r u, with p those at first, u upwards and r how far each rose, lie on the surface of the run."""
    run = tossed(rippled, 0.2)
    data = content(run, scene(run, COUNT))
    (sheet,) = data["sheets"]
    count = sheet["rows"] * sheet["count"]
    first = np.array([unpacked(axis, count) for axis in sheet["at"]]).T
    step = sheet["at"][0]["step"]
    assert data["spatial"] and len(sheet["risen"]) == len(sheet["times"]) - 1 > 5 and not sheet["holes"]
    for t, risen in zip(sheet["times"][1:], sheet["risen"], strict=True):
        x, y, z = in_ground_axes(run, first + unpacked(risen, count)[:, None] * sheet["up"]).T
        np.testing.assert_allclose(y, 0.2 * x * x + 0.1 * z + 0.05 * np.sin(3.0 * x - 2.0 * t), atol=10.0 * step)


def in_ground_axes(run: mbd.Trajectory, places):
    return np.asarray(places) @ upright(run)


@pytest.mark.parametrize(("ground", "depth"), [(waves, 0.0), (bowl, 0.2), (lambda x: 0.2 * x - 0.1 * abs(x), 0.0)])
def test_every_point_of_a_drawn_surface_lies_on_the_surface_of_the_run(ground, depth):
    run = tossed(ground, depth)
    (sheet,) = scene(run, COUNT).around.sheets
    x, y, z = np.moveaxis(in_ground_axes(run, sheet.lines), -1, 0)
    t = np.broadcast_to(sheet.times.reshape(-1, 1, 1), x.shape)
    expected = {
        waves: lambda: 0.1 * np.sin(3.0 * x - 2.0 * t) + np.where(x < 0.3, 0.05, 0.0),
        bowl: lambda: 0.4 * x * x + 0.2 * z * z,
    }.get(ground, lambda: 0.2 * x - 0.1 * np.abs(x))()
    np.testing.assert_allclose(y, expected, atol=1e-12 * np.max(np.abs(sheet.lines)))
    assert x.min() < run["ball.origin"][:, 0].min() and x.max() > run["ball.origin"][:, 0].max()
    assert (len(sheet.times) > 1) == (ground is waves)


@pytest.mark.parametrize(("ground", "depth"), [(waves, 0.0), (bowl, 0.2), (None, 0.0)])
def test_forces_of_feet_on_any_ground_are_those_that_move_them(ground, depth):
    """Newton's law of the point: F = m (a − g)."""
    run = tossed(ground, depth)
    picture = scene(run, COUNT)
    (push,) = picture.pushes
    g = np.array([run.parameters.get(f"gravity.{axis}", 0.0) for axis in "xyz"])
    axes = ["x", "y", "z"] if depth else ["x", "y"]
    moved = picture.instants.read(run, [f"free.{axis}.acceleration" for axis in axes])
    moved = np.column_stack([moved, np.zeros((len(moved), 3 - len(axes)))])
    np.testing.assert_allclose(in_ground_axes(run, push.force), moved - g, atol=1e-9 * np.max(np.abs(push.force)))


def test_a_wheel_rolls_on_the_ground_it_is_drawn_on():
    """Its rim touches the deck and nothing passes through; the rim's material point there moves with the deck's."""
    run = rolled()
    around = scene(run, COUNT).around
    (wheel,), (deck,) = around.wheels, around.decks
    below = wheel.center - wheel.radius[:, None] * deck.normal
    assert wheel.radius == pytest.approx(RADIUS)
    np.testing.assert_allclose(np.sum((below - deck.place) * deck.normal, axis=1), 0.0, atol=1e-9)
    time = Instants.of(run, COUNT).time
    turned = np.unwrap(np.arctan2(wheel.spoke[:, 1], wheel.spoke[:, 0]))
    np.testing.assert_allclose(turned, run.at(time)["free.angle"], atol=1e-9)
    along = np.sum((wheel.center - deck.place) * deck.forward, axis=1)
    np.testing.assert_allclose(along - along[0], -RADIUS * (turned - turned[0]), atol=2e-6)


def test_a_blade_lies_along_its_motion():
    run = sleigh()
    (blade,) = scene(run, COUNT).around.blades
    velocity = run.at(Instants.of(run, COUNT).time)
    moved = np.stack([velocity[f"sleigh.runner.v{axis}"] for axis in "xyz"], axis=1)
    np.testing.assert_allclose(np.cross(blade.along, moved), 0.0, atol=1e-9)


@pytest.mark.parametrize("make", [lambda: tossed(waves), lambda: tossed(bowl, 0.2), rolled, sleigh])
def test_a_file_keeps_what_is_drawn(make, tmp_path):
    run = make()
    loaded = mbd.load(run.save(tmp_path / "run"))
    same_content(content(loaded, scene(loaded, COUNT)), content(run, scene(run, COUNT)))
    assert not [name for name in (*run.names, *loaded.names) if name.startswith("drawn")]


def same_content(found: Any, expected: Any) -> None:
    """The same words and numbers; series of numbers to round-off, as between rows a file has no machine code."""
    if isinstance(expected, dict) and expected.keys() == {"step", "d"}:
        count = max(len(found["d"]), len(expected["d"]))
        numbers = unpacked(expected, count)
        np.testing.assert_allclose(unpacked(found, count), numbers, rtol=0.0, atol=1e-12 + 2.0 * expected["step"])
    elif isinstance(expected, dict):
        assert list(found) == list(expected)
        for name in expected:
            same_content(found[name], expected[name])
    elif isinstance(expected, list):
        assert len(found) == len(expected)
        for one, other in zip(found, expected, strict=True):
            same_content(one, other)
    else:
        assert found == expected


def test_a_foot_that_sticks_has_no_chart_of_power():
    run = tossed(waves)
    assert 0.0 < np.max(np.abs(run["foot friction.power"])) < 1e-12
    assert "power" not in [chart["title"] for chart in content(run, scene(run, COUNT))["charts"]]


def test_a_file_of_chosen_names_draws_what_it_has(tmp_path):
    loaded = mbd.load(rolled().save(tmp_path / "run", names=[name for name, _ in rolled().facts.coordinates]))
    picture = scene(loaded, COUNT)
    assert not picture.points and not picture.around.wheels and len(picture.around.decks) == 1
    loaded.page(tmp_path / "page.html")


@pytest.mark.parametrize("op", [op for op in (*UNARY, *BINARY) if op not in ("lt", "le", "and", "or", "not")])
def test_numbers_of_arrays_are_those_of_single_numbers(op):
    tape = Tape()
    x, y = tape.input("q", 0), tape.input("q", 1)
    node = tape.unary(op, x) if op in UNARY else tape.binary(op, x, y)
    a, b = np.array([0.3, -0.7, 0.0, 2.5, -1.0]), np.array([0.2, 1.0, -0.4, 2.5, 3.0])
    found = evaluate_arrays(node, {("q", 0): a, ("q", 1): b})
    single = [evaluate([node], {("q", 0): p, ("q", 1): q})[0] for p, q in zip(a, b, strict=True)]
    np.testing.assert_allclose(found, single, rtol=1e-15)
