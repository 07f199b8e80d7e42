"""Gaits in space: quaternions on the section, reflections, and walkers of the plane among those of space."""

import math
import warnings
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import mbd
from mbd.gait.exact_derivative import exact_derivative
from mbd.gait.limit_cycle import map_of
from mbd.gait.map_derivative import differences

g = 9.81
SIDES = ("left", "right")


# a rimless wheel that may lean and turn -------------------------------------------------------------------------------
SPOKES, HALF = 8, math.pi / 8


@cache
def rimless_wheel() -> mbd.Model:
    """Spokes of 1 m and a hub that turns freely, down a slope."""
    model = mbd.Model("rimless wheel", gravity=mbd.on_slope(0.15, g))
    wheel = mbd.RigidBody("wheel", 1.0, (0.21, 0.22, 0.41))
    model.connect(mbd.Free("hub", model.ground.origin, wheel.origin))
    for k in range(SPOKES):
        angle = 2.0 * HALF * k
        tip = wheel.point(math.sin(angle), -math.cos(angle), 0.0, name=f"tip {k}")
        release = mbd.When(f"spoke {(k + 1) % SPOKES}")
        model.constrain(mbd.Unilateral(f"spoke {k}", mbd.touchdown(tip), release=release))
    return model


def wheel_step(slope: float, inertia: tuple[float, float, float], mass: float) -> Any:
    """One step of the wheel, (R, ω) → (R, ω) in body axes, spokes numbered anew: Euler's equations about the tip, and
    the angular momentum about the next tip kept at its strike (M. J. Coleman, A. Chatterjee & A. Ruina, Dynamics and
    Stability of Systems 12 (1997) 139).
    """
    center, down = np.diag(inertia), g * np.array([math.sin(slope), -math.cos(slope), 0.0])
    now, then = np.array([0.0, -1.0, 0.0]), np.array([math.sin(2 * HALF), -math.cos(2 * HALF), 0.0])
    about = {k: center + mass * (np.eye(3) - np.outer(r, r)) for k, r in enumerate((now, then))}
    renumber = Rotation.from_rotvec([0.0, 0.0, 2 * HALF]).as_matrix()

    def rates(t: float, y: Any) -> Any:
        R, w = y[:9].reshape(3, 3), y[9:]
        x = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        moment = np.cross(-now, mass * R.T @ down) - np.cross(w, about[0] @ w)
        return np.concatenate([(R @ x).ravel(), np.linalg.solve(about[0], moment)])

    def strike(t: float, y: Any) -> Any:
        return y[3:6] @ (then - now)

    strike.terminal, strike.direction = True, -1  # type: ignore[attr-defined]

    def step(R: Any, w: Any) -> tuple[Any, Any]:
        begin = np.concatenate([R.ravel(), w])
        run = solve_ivp(rates, (0.0, 20.0), begin, method="DOP853", rtol=1e-11, atol=1e-12, events=strike)
        R, w = run.y[:9, -1].reshape(3, 3), run.y[9:, -1]
        w = np.linalg.solve(about[1], center @ w - mass * np.cross(then, np.cross(w, -now)))
        return R @ renumber, renumber.T @ w

    return step


def wheel_multipliers(slope: float, inertia: tuple[float, float, float], mass: float, rate: float) -> Any:
    """Of one step, from differences of the step above by lean, heading and ω."""
    step, base = wheel_step(slope, inertia, mass), Rotation.from_rotvec([0.0, 0.0, HALF]).as_matrix()
    left = np.array([-math.sin(2 * HALF), 1.0 - math.cos(2 * HALF), 0.0])

    def state(c: Any) -> tuple[Any, Any]:
        turned = Rotation.from_rotvec([c[0], c[1], 0.0]).as_matrix() @ base
        roll = brentq(lambda a: (turned @ Rotation.from_rotvec([0, 0, a]).as_matrix() @ left)[1], -0.2, 0.2, xtol=1e-15)
        return turned @ Rotation.from_rotvec([0.0, 0.0, roll]).as_matrix(), c[2:] + np.array([0.0, 0.0, rate])

    def numbers(R: Any, w: Any) -> Any:
        axle = R[:, 2]  # exp(c) z = z + c × z at first order, and exactly by the angle
        size = math.hypot(axle[0], axle[1]) or 1.0
        part = math.atan2(size, axle[2]) / size
        return np.concatenate([[-part * axle[1], part * axle[0]], w - [0.0, 0.0, rate]])

    def slope_of(h: float) -> Any:
        ends = [[numbers(*step(*state(sign * h * unit))) for sign in (1, -1)] for unit in np.eye(5)]
        return np.array([(ahead - behind) / (2.0 * h) for ahead, behind in ends]).T

    return np.linalg.eigvals((4.0 * slope_of(1e-4) - slope_of(2e-4)) / 3.0)


@cache
def wheel_gait(slope: float, inertia: tuple[float, float, float], mass: float) -> tuple[mbd.LimitCycle, float]:
    """The wheel's steady roll, and its rate just after a strike."""
    kept = (inertia[2] + mass * math.cos(2 * HALF)) / (inertia[2] + mass)
    gained = 4.0 * mass * g * math.sin(HALF) * math.sin(slope) / (inertia[2] + mass)
    rate = -kept * math.sqrt(gained / (1.0 - kept**2))
    values = {"gravity.x": g * math.sin(slope), "gravity.y": -g * math.cos(slope), "wheel.mass": mass}
    values |= {f"wheel.inertia.{axis}{axis}": float(value) for axis, value in zip("xyz", inertia, strict=True)}
    start = mbd.assemble(
        rimless_wheel(), closed="spoke 0", parameters=values,
        position={"hub.y": math.cos(HALF), "hub.orientation": ((0, 0, 1), HALF)},
        velocity={"hub.angular_velocity.z": 0.97 * rate},
    )  # fmt: skip
    return mbd.limit_cycle(rimless_wheel(), start, section="spoke 0", parameters=values), rate


@pytest.mark.parametrize("seed", [1, 2])
def test_a_rimless_wheel_leans_and_turns_as_euler_says(seed: int) -> None:
    random = np.random.default_rng(seed)
    slope, mass = random.uniform(0.2, 0.3), random.uniform(0.8, 1.5)
    across, along = random.uniform((0.2, 0.3), (0.3, 0.4))
    inertia = (float(across), float(across), float(along))
    gait, rate = wheel_gait(slope, inertia, mass)
    assert gait.state.v[5] == pytest.approx(rate, rel=1e-10)
    once = wheel_multipliers(slope, inertia, mass, rate)
    key = lambda value: (-abs(value), value.imag)  # noqa: E731
    expected = sorted(once**SPOKES, key=key)
    assert np.array(sorted(gait.multipliers, key=key)) == pytest.approx(np.array(expected), rel=1e-8, abs=1e-9)
    kept = (inertia[2] + mass * math.cos(2 * HALF)) / (inertia[2] + mass)
    assert np.min(np.abs(gait.multipliers - kept ** (2 * SPOKES))) < 1e-10  # as it rolls in its plane
    assert np.min(np.abs(gait.multipliers - 1.0)) < 1e-9  # on a slope it rolls along any heading
    assert set(gait.trivial) >= {"translation hub.x", "translation hub.z"}


@pytest.mark.parametrize("seed", [1, 2])
def test_the_exact_derivative_of_the_map_is_that_of_differences(seed: int) -> None:
    random = np.random.default_rng(seed)
    gait, _ = wheel_gait(float(random.uniform(0.2, 0.3)), (0.25, 0.25, 0.35), float(random.uniform(0.8, 1.5)))
    c = random.uniform(-1e-2, 1e-2, gait.chart.size)  # beside the gait, where a chart's increments are no tangents
    exact = exact_derivative(gait.map, gait.chart, c, gait.parameters)
    found = differences(gait.map, gait.chart, c, gait.parameters)
    assert exact is not None
    known = np.isfinite(exact)
    assert np.array_equal(known, np.isfinite(found.matrix)) and np.all(known[: gait.chart.size])
    off = np.abs(exact - found.matrix) - 2.0 * found.error - 1e-10 * np.nanmax(np.abs(exact))
    assert np.all(off[known] <= 0.0)


# a walker with hips of a width ----------------------------------------------------------------------------------------
@cache
def rocking(width: float = 0.2, across: int = 2) -> mbd.Model:
    """Straight legs with disk feet under a pelvis that rolls, as A. D. Kuo (Int. J. Robotics Res. 18 (1999) 917) has
    three freedoms in stance. `across` is the axis to the side: z, or y with z down.
    """

    def way(x: float, y: float, z: float) -> Any:
        return (x, y, z) if across == 2 else (x, z, -y)

    slope, down = 0.03, way(0.0, -1.0, 0.0)
    gravity = np.array([g * math.sin(slope), 0.0, 0.0]) + g * math.cos(slope) * np.array(down)
    model = mbd.Model("rocking walker", gravity=tuple(map(float, gravity)))
    ground, side = mbd.Plane(normal=way(0, 1, 0)), way(0, 0, 1)
    hip, pelvis = mbd.PointMass("hip", 0.68), mbd.RigidBody("pelvis", 0.001, (0.002, 0.002, 0.002))
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin, axes="xyz"))
    model.connect(mbd.Revolute("roll", hip.origin, pelvis.origin, axis=(1, 0, 0)))
    moments, center = tuple(map(abs, way(0.0064, 0.0005, 0.0064))), way(0.0, -0.355, 0.0)
    legs = {each: mbd.RigidBody(f"{each} leg", 0.16, moments, center=center) for each in SIDES}
    feet = {each: legs[each].point(*way(0.0, -0.7, 0.0), name="arch") for each in SIDES}
    for mine, other, z in ((*SIDES, -1.0), (*SIDES[::-1], 1.0)):
        ahead = mbd.measure(lambda this, that: this[0] - that[0] - 0.1, feet[mine], feet[other])
        socket = pelvis.point(*way(0.0, 0.0, z * 0.5 * width), name=f"{mine} socket")
        model.connect(mbd.Revolute(f"{mine} hip", socket, legs[mine].origin, axis=side))
        edge = mbd.disk_touchdown(feet[mine], 0.3, side, ground)
        release = mbd.When(f"{other} foot")
        model.constrain(mbd.Unilateral(f"{mine} foot", edge, friction=0, release=release, only_while=ahead))
        model.constrain(mbd.Rolling(f"{mine} grip", feet[mine], 0.3, ground, f"{mine} foot", axis=side))
    return model


@cache
def rocking_gait(width: float = 0.2, across: int = 2, mirrored: bool = True) -> mbd.LimitCycle:
    """Its slow walk."""
    model = rocking(width, across)
    start = mbd.assemble(
        model, closed="left foot",
        position={"left hip.angle": 0.326, "right hip.angle": -0.317, "roll.angle": -0.0099},
        velocity={"left hip.angle": -1.127, "right hip.angle": -0.560, "roll.angle": -0.2544},
    )  # fmt: skip
    if mirrored:
        return mbd.limit_cycle(model, start, section="right foot", mirror=SIDES)
    return mbd.limit_cycle(model, rocking_gait(width, across).state, section="left foot")


def test_a_walker_rocks_and_one_lateral_mode_grows() -> None:
    gait = rocking_gait()
    sizes = np.abs(gait.multipliers)
    assert np.sum(sizes > 1.0) == 1 and sizes[1] < 0.6
    assert gait.multipliers[0].imag == 0.0 and gait.multipliers[0].real < -5.0  # it falls to the side, turn about
    fastest = max(gait.modes[0], key=lambda name: abs(gait.modes[0][name]))
    assert fastest in ("roll.angle.rate", "trunk.z.rate")
    assert gait.trivial["translation trunk.z"] == -1.0 and gait.trivial["translation trunk.x"] == 1.0
    assert gait.cost_of_transport == pytest.approx(math.sin(0.03) / 1.0, rel=1e-9)
    assert max(gait.residual.values()) < 1e-10


def test_a_stride_of_two_sides_is_a_mirrored_step_twice() -> None:
    step, stride = rocking_gait(), rocking_gait(mirrored=False)
    assert stride.period == pytest.approx(2.0 * step.period, rel=1e-10)
    assert stride.distance == pytest.approx(2.0 * step.distance, rel=1e-10)
    squares = sorted(np.abs(step.multipliers) ** 2)
    assert sorted(np.abs(stride.multipliers)) == pytest.approx(squares, rel=1e-5, abs=1e-7)


def test_a_gait_found_repeats_itself_in_a_run() -> None:
    gait = rocking_gait()
    run = gait.walk(1)
    again, here = gait.map.mirror.state(run.final), gait.state
    assert np.max(np.abs(again.v - here.v)) < 1e-10
    moved = [k for k in range(len(here.q)) if k not in gait.chart.section.fixed]
    assert np.max(np.abs((again.q - here.q)[moved])) < 1e-10


def test_what_is_stored_of_sideways_motion_changes_its_sign_in_the_mirror() -> None:
    """A remembered roll and its rate, and samples of the roll that wait for two periods."""
    model = rocking.__wrapped__()
    pelvis = next(joint for joint in model.joints if joint.name == "roll")
    steps = [mbd.Transition("left", "right", on="right foot"), mbd.Transition("right", "left", on="left foot")]
    law = mbd.SampledLaw("sway", 0.05, {"u": lambda q, v, s: -0.01 * q - 0.01 * s},
                         arguments=("roll.angle", "roll.angle.rate", "sway.sum"), delay=0.1, restart_on=("stance",),
                         states={"sum": lambda q, v, s: s + v})  # fmt: skip
    remembered = {"roll": "roll.angle", "rate": "roll.angle.rate", "speed": "trunk.x.rate"}
    model.constrain(mbd.Mode("stance", SIDES, transitions=steps, remembers=remembered), law)
    model.apply(mbd.Motor("balance", pelvis, torque=lambda u, v: u - 0.01 * v, arguments=["sway.u", "stance.rate"]))
    start = mbd.assemble(model, closed="left foot")
    cycle = ("right foot", SIDES, 1)
    found = map_of(model, start, mbd.RungeKutta853(), 0.05, cycle, None, None, None, 10.0, "python")
    signs = {
        f"{machine.name}.{field}": found.mirror.reflection.anchors[anchor]
        for machine in found.mechanism.equations.machines
        for field, anchor in zip(machine.fields, machine.anchors, strict=True)
    }
    odd = {name for name, sign in signs.items() if sign < 0.0}
    assert odd == {"stance.roll", "stance.rate", "sway.u", "sway.u 1", "sway.u 2", "sway.sum"}


def test_the_axis_to_the_side_is_found() -> None:
    one, other = rocking_gait(), rocking_gait(across=1)
    assert (one.map.mirror.reflection.axis, other.map.mirror.reflection.axis) == ("z", "y")
    assert other.period == pytest.approx(one.period, rel=1e-10)
    assert np.abs(other.multipliers) == pytest.approx(np.abs(one.multipliers), rel=1e-6)


# the plane in space ---------------------------------------------------------------------------------------------------
@cache
def compass(spatial: bool) -> mbd.LimitCycle:
    """A compass gait in the plane, or on the same hinges with a hip that may also lean, turn and move to the side."""
    model = mbd.Model("compass", gravity=mbd.on_slope(math.radians(3.0)))
    hip = mbd.PointMass("hip", 10.0)
    legs = {side: mbd.RigidBody(f"{side} leg", 5.0, (0.02, 0.01, 0.02), center=(0.0, -0.5, 0.0)) for side in SIDES}
    feet = {side: legs[side].point(0.0, -1.0, 0.0, name="foot") for side in SIDES}
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin, axes="xyz" if spatial else "xy"))
    model.connect((mbd.Spherical if spatial else mbd.Revolute)("leg", hip.origin, legs["left"].origin))
    model.connect(mbd.Revolute("hinge", legs["left"].origin, legs["right"].origin))
    for side, other in (SIDES, SIDES[::-1]):
        ahead = mbd.measure(lambda this, that: this[0] - that[0] - 0.1, feet[side], feet[other])
        rule = {"release": mbd.When(f"{other} foot"), "only_while": ahead}
        model.constrain(mbd.Unilateral(f"{side} foot", mbd.touchdown(feet[side]), **rule))
    turn = {"leg.orientation": ((0, 0, 1), 0.27)} if spatial else {"leg.angle": 0.27}
    spin = {"leg.angular_velocity.z": -1.1} if spatial else {"leg.angle": -1.1}
    start = mbd.assemble(model, {**turn, "hinge.angle": -0.54}, {**spin, "hinge.angle": 0.7}, closed="left foot")
    return mbd.limit_cycle(model, start, section="left foot")


def test_a_walker_of_the_plane_walks_in_space() -> None:
    flat, free = compass(False), compass(True)
    assert free.period == pytest.approx(flat.period, rel=1e-8)
    assert free.distance == pytest.approx(flat.distance, rel=1e-8)
    for value in flat.multipliers:
        assert np.min(np.abs(free.multipliers - value)) < 2e-8
    assert {"leg.turn.x", "hinge.angle", "leg.angular_velocity.x"} < set(free.modes[0])
    assert free.map_derivative.how == flat.map_derivative.how == "exact"
    assert len(free.multipliers) > len(flat.multipliers)


def test_pictures_show_orientations_and_multipliers_far_off(tmp_path: Any) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = compass(True).plot(tmp_path / "gait.png")
    left, right = figure.axes
    assert "leg.rotation_vector.z" in [text.get_text() for text in left.get_legend().get_texts()]
    assert right.get_xlim()[1] < 4.0 and "215.2" in [text.get_text() for text in right.texts]


# many starts ----------------------------------------------------------------------------------------------------------
def test_a_batch_of_quaternions_is_the_runs_to_the_bit() -> None:
    random = np.random.default_rng(4)
    base = mbd.assemble(rimless_wheel(), {"hub.y": 1.05, "hub.orientation": ((1, 2, 3), 0.3)})
    columns = {f"hub.angular_velocity.{axis}": random.uniform(-2.0, 2.0, 4) for axis in "xyz"}
    columns["hub.y"] = random.uniform(1.04, 1.1, 4)
    options = {"dt": 0.02, "until": 0.3, "contact": "events"}
    found = mbd.batch(rimless_wheel(), (base, columns), mbd.RungeKutta853(), **options)
    landed = 0
    for k in range(4):
        start = found.start(k)
        assert list(start.v[3:]) == [columns[f"hub.angular_velocity.{axis}"][k] for axis in "xyz"]
        run = mbd.simulate(rimless_wheel(), start, mbd.RungeKutta853(), **options)
        assert np.array_equal(found.final(k).q, run.final.q) and np.array_equal(found.final(k).v, run.final.v)
        landed += bool(run.events)
    assert landed


def test_a_part_of_a_quaternion_alone_is_refused_by_name() -> None:
    base = wheel_gait(0.2, (0.25, 0.25, 0.35), 1.0)[0].state
    with pytest.raises(mbd.ModelError, match=r"'hub.orientation.x' is a part of a quaternion"):
        mbd.batch(rimless_wheel(), (base, {"hub.orientation.x": [0.0, 0.1]}), dt=0.01, until=0.1)


def test_a_search_takes_whole_orientations() -> None:
    position = {"hub.y": math.cos(HALF), "hub.orientation": ((0, 0, 1), HALF)}
    found = mbd.find_gait(
        rimless_wheel(), position, {"hub.angular_velocity.z": (-2.6, -2.4)}, closed="spoke 0", section="spoke 0",
        parameters={"gravity.x": g * math.sin(0.25), "gravity.y": -g * math.cos(0.25)}, tries=2,
    )  # fmt: skip
    assert len(found.gaits) == 1 and found.gait.multipliers.size == 5
