"""`mbd.sensitivities`: what it is asked for, what it refuses, and faults that others have had."""

import math

import numpy as np
import pytest

import mbd
from tests.helpers import one_body
from tests.sensitivity.differences import differences, off
from tests.simulation.mechanisms import ball, kneed_walker, kneed_walker_start, pendulum

SLOPE = 0.0504
ON_SLOPE = {"slope": {"gravity.x": lambda s: 9.81 * mbd.sin(s), "gravity.y": lambda s: -9.81 * mbd.cos(s)}}
NAMES = ["left hip.angle", "right hip.angle", "left hip.angle.rate", "right hip.angle.rate"]
VALUES = [0.2385854603, -0.2385854603, -1.1095873312, -0.0571481063]
RESULTS = [
    "time", "right knee lock.time", "left hip.angle", "right hip.angle.rate", "right foot.force",
    "left hip.reaction_force.x", "right shank.end.x",
]  # fmt: skip
WALKER = kneed_walker(SLOPE)


def walked(changes, slope=SLOPE):
    """Results after a step of the walker from a start with changed angles and rates, on a changed slope."""
    x, y, _ = mbd.on_slope(slope)
    values = dict(zip(NAMES, VALUES, strict=True))
    values = {name: value + changes.get(name, 0.0) for name, value in values.items()}
    start = mbd.assemble(
        WALKER, {name: values[name] for name in NAMES[:2]},
        {**{name: values[name] for name in NAMES[2:]}, "right knee.angle": 0.0},
        closed=["left foot", "left knee lock"], open=["right foot"], parameters={"gravity.x": x, "gravity.y": y},
    )  # fmt: skip
    run = mbd.simulate(WALKER, start, mbd.RungeKutta853(), dt=0.01, until="right foot")
    knee = next(event.time for event in run.events if event.name == "right knee lock" and event.kind == "closed")
    return np.array([run.final.time, knee, *(run[name][-1] for name in RESULTS[2:])])


def quotient(by, size=2e-4):
    found = [(by(step) - by(-step)) / (2.0 * step) for step in (size, size / 2.0)]
    return (4.0 * found[1] - found[0]) / 3.0


def test_results_and_instants_of_a_walker_by_its_start_and_the_slope():
    found = mbd.sensitivities(
        WALKER, kneed_walker_start(WALKER, open=["right foot"]), mbd.RungeKutta853(), dt=0.01, until="right foot",
        wrt=[NAMES[0], NAMES[3], ON_SLOPE], at={"slope": SLOPE}, of=RESULTS,
        hold=[*NAMES, "right knee.angle", "right knee.angle.rate"],
    )  # fmt: skip
    wanted = [
        quotient(lambda step: walked({NAMES[0]: step})), quotient(lambda step: walked({NAMES[3]: step})),
        quotient(lambda step: walked({}, SLOPE + step)),
    ]  # fmt: skip
    assert found.of == tuple(RESULTS) and found.wrt == (NAMES[0], NAMES[3], "slope")
    assert found.values == pytest.approx(walked({}), rel=1e-9)
    sizes = np.max(np.abs(found.matrix), axis=0)
    assert np.max(np.abs(found.matrix - np.array(wanted).T) / sizes) < 2e-8


def test_a_table_is_read_by_names():
    model = pendulum()
    found = mbd.sensitivities(
        model, mbd.assemble(model, {"hinge.angle": 1.0}), dt=0.01, until=0.5,
        wrt=["hinge.angle", {"both": {"rod.center": 1.0, "rod.inertia": 2.0}}],
    )  # fmt: skip
    assert found.of == ("hinge.angle", "hinge.angle.rate", "time")
    assert found["hinge.angle"].shape == (2,) and found["time", "both"] == 0.0
    assert found.along({"hinge.angle": 2.0})["hinge.angle"] == 2.0 * found["hinge.angle", "hinge.angle"]
    assert list(found.to_dataframe().columns) == ["hinge.angle", "both"]
    assert "hinge.angle" in repr(found) and "by both" in found._repr_html_()
    with pytest.raises(mbd.UnknownNameError, match="no line named 'hinge'"):
        found["hinge"]


def test_a_folded_parameter_becomes_an_input():
    model = pendulum()  # its mass is 1, which the equations fold
    found = mbd.sensitivities(
        model, mbd.assemble(model, {"hinge.angle": 1.0}), dt=0.01, until=0.5, wrt=["rod.mass"], of=["hinge.angle"]
    )
    assert found.run["rod.mass"][-1] == 1.0 and abs(found["hinge.angle", "rod.mass"]) > 1e-3


def test_a_folded_parameter_is_derived_for_once():
    model, _ = one_body(mbd.Link("rod", mass=1.0, length=1.0, center=0.5), mbd.Revolute, "pin")
    start = mbd.assemble(model, {"pin.angle": 0.5})
    ask = {"dt": 0.01, "until": 0.1, "wrt": ["rod.mass"]}
    one, two = (mbd.sensitivities(model, start, **ask).run.record.equations for _ in range(2))
    model.constrain(mbd.Event("below", mbd.measure(lambda angle: angle, "pin.angle")))
    assert (
        two is one
        and mbd.sensitivities(model, mbd.assemble(model, {"pin.angle": 0.5}), **ask).run.record.equations is not one
    )


def test_after_an_event_derivatives_have_its_shift():
    """Others' derivative of a state behind an event left out that the event comes later (diffrax, issue 729)."""
    model = ball(restitution=1.0)
    found = mbd.sensitivities(
        model, mbd.assemble(model, {"fall.displacement": 1.0}), mbd.Newmark(), dt=1e-3, until=0.8,
        wrt=["fall.displacement.rate"], of=["fall.displacement"],
    )  # fmt: skip
    fall, g = np.sqrt(2.0 / 9.81), 9.81
    left, down = 0.8 - fall, np.sqrt(2.0 * g)
    by_instant = 1.0 / g  # a throw up by v lengthens the fall by v/g
    assert found["fall.displacement", "fall.displacement.rate"] == pytest.approx(
        -by_instant * down + g * left * by_instant, rel=1e-9
    )


def test_a_row_at_an_event_has_no_other_derivative_than_its_neighbours():
    """A sample that meets an event was wrong by 7 % elsewhere (SciMLSensitivity, issue 1447)."""
    model = ball(restitution=0.5)
    start = mbd.assemble(model, {"fall.displacement": 0.5 * 9.81 * 0.4**2})  # it lands on the grid
    wrt, of = ["fall.displacement"], ["fall.displacement.rate"]
    ends = [0.4 - 1e-9, 0.4 + 1e-9, 0.41]
    before, after, later = (
        mbd.sensitivities(model, start, mbd.Newmark(), dt=0.1, until=end, wrt=wrt, of=of).matrix[0, 0] for end in ends
    )
    fall = 0.4
    assert before == pytest.approx(0.0, abs=1e-9)
    by_instant = 1.0 / (9.81 * fall)
    assert after == pytest.approx(0.5 * 9.81 * by_instant + 9.81 * by_instant, rel=1e-6)
    assert later == pytest.approx(after, rel=1e-9)


@pytest.mark.parametrize("scheme", [mbd.HHT(0.05, tolerance=1e-12), mbd.RungeKutta853()], ids=repr)
def test_resets_are_differentiated(scheme):
    model = pendulum()
    back = mbd.measure(lambda angle: angle, "hinge.angle")
    turned = {"hinge.rate": lambda named: -0.5 * named["hinge.rate"] * mbd.cos(named["rod.center"]), "hinge.angle": 0.1}
    model.constrain(mbd.Event("back", back, reset=turned, direction=-1))
    start = mbd.assemble(model, {"hinge.angle": 1.0})
    settings = {"dt": 0.01, "until": 1.0}
    names = ["hinge.angle", "hinge.angle.rate", "rod.center"]
    found = mbd.sensitivities(model, start, scheme, wrt=names, **settings)
    assert [event.name for event in found.run.events] == ["back"]
    assert off(found.matrix, differences(model, start, scheme, names, **settings)[0]).max() < 1e-8


def test_two_events_at_one_instant_are_named():
    box = mbd.Model("two")
    for name in "ab":
        body = mbd.PointMass(f"ball {name}", mass=1.0)
        box.connect(mbd.Prismatic(name, box.ground.origin, body.origin, axis="y"))
        box.constrain(mbd.Unilateral(f"floor {name}", mbd.height(body.origin)))
    start = mbd.assemble(box, {"a.displacement": 1.0, "b.displacement": 1.0})
    with pytest.raises(mbd.CapabilityError, match="'floor a' and 'floor b' happen at one instant, t = 0.4515"):
        mbd.sensitivities(box, start, dt=0.01, until=0.6, wrt=["a.displacement"])


def test_a_graze_is_named():
    model, _ = one_body(mbd.PointMass("bob", 1.0), mbd.Translation, "place", title="graze")
    start_height = 1e-14
    model.constrain(mbd.Unilateral("roof", mbd.measure(lambda y: 1.0 - start_height - y, "place.y")))
    speed = np.sqrt(2.0 * 9.81)
    start = mbd.assemble(model, {"place.y": 0.0}, {"place.y.rate": speed, "place.x.rate": 1.0})
    with pytest.raises(mbd.CapabilityError, match="'roof' only grazes at t = 0.4515"):
        mbd.sensitivities(model, start, mbd.RungeKutta853(), dt=0.01, until=0.6, wrt=["place.y.rate"])


RESET = mbd.Event(
    "back", mbd.measure(lambda angle: angle, "hinge.angle"),
    reset=lambda named: {"hinge.rate": -0.5 * math.sin(named["hinge.rate"])},
)  # fmt: skip
SAMPLED = mbd.Controller("sampled", lambda time, values, state: None, period=0.1, writes=["rod.center"])


@pytest.mark.parametrize(
    ("change", "words"),
    [(lambda model: model.constrain(RESET), "reset"), (lambda model: model.apply(SAMPLED), "controllers")],
    ids=["reset", "controller"],
)
def test_what_is_not_differentiated_is_named(change, words):
    model = pendulum()
    change(model)
    start = mbd.assemble(model, {"hinge.angle": 1.0})
    with pytest.raises(mbd.CapabilityError, match=words):
        mbd.sensitivities(model, start, dt=0.01, until=1.0, wrt=["hinge.angle"])


def test_wrong_questions_are_answered():
    model = pendulum()
    start = mbd.assemble(model, {"hinge.angle": 1.0})

    def asked(wrt=("hinge.angle",), **more):
        return mbd.sensitivities(model, start, dt=0.01, until=0.1, wrt=list(wrt), **more)

    with pytest.raises(mbd.UnknownNameError, match="'hinge.angel'"):
        asked(["hinge.angel"])
    with pytest.raises(mbd.UnknownNameError, match="of: no result named 'hinge.angel'"):
        asked(of=["hinge.angel"])
    with pytest.raises(mbd.ModelError, match="give its value too, as at="):
        asked([ON_SLOPE])
    with pytest.raises(mbd.ModelError, match="'gravity.x' is 0.979"):
        asked([ON_SLOPE], at={"slope": 0.1})
    with pytest.raises(mbd.CapabilityError, match="averaged"):
        asked(integrator=mbd.HHT(0.05, form="averaged"))


def test_a_run_carries_its_derivatives(tmp_path):
    model = pendulum()
    start = mbd.assemble(model, {"hinge.angle": 1.0})
    wrt = ["hinge.angle", "rod.mass", {"both": {"rod.center": 1.0, "rod.inertia": 2.0}}]
    run = mbd.simulate(model, start, dt=0.01, until=1.0, wrt=wrt)
    found = mbd.sensitivities(model, start, dt=0.01, until=1.0, wrt=wrt)
    assert np.array_equal(run.sensitivities.matrix, found.matrix) and run.sensitivities.run is run
    again = mbd.load(run.save(tmp_path / "run")).sensitivities
    assert np.array_equal(again.matrix, found.matrix) and (again.of, again.wrt) == (found.of, found.wrt)
    with pytest.raises(mbd.TrajectoryError, match="wrt="):
        assert mbd.simulate(model, start, dt=0.01, until=0.1).sensitivities
    with pytest.raises(mbd.UnknownNameError, match="wrt: no coordinate.* 'hinge.angel'"):
        mbd.simulate(model, start, dt=0.01, until=0.1, wrt=["hinge.angel"])
    with pytest.raises(mbd.CapabilityError, match="locate='root'"):
        mbd.simulate(model, start, dt=0.01, until=0.1, wrt=["hinge.angle"], locate="linear")
    sparse = mbd.simulate(model, start, dt=0.01, until=1.0, wrt=wrt, store=7).sensitivities
    assert sparse.matrix == pytest.approx(found.matrix, rel=1e-8, abs=1e-12)


def test_changes_that_make_other_events_are_named():
    model = ball(restitution=0.6)
    start = mbd.assemble(model, {"fall.displacement": 1.0})
    settings = {"dt": 0.01, "until": 0.46, "wrt": ["fall.displacement", "gravity.y"]}
    found = mbd.sensitivities(model, start, check_events={"fall.displacement": 0.1, "gravity.y": 0.01}, **settings)
    sentence = "fall.displacement + 0.1: event 1 is none, in the run 'floor' closed"
    assert found.event_changes == (sentence,) and sentence in repr(found)
    assert mbd.sensitivities(model, start, **settings).event_changes == ()
    for wrong, words in [({"fall": 1.0}, "no name in wrt"), ({"gravity.y": -1.0}, "changes > 0"), ([1], "changes > 0")]:
        with pytest.raises(mbd.MbdError, match=words):
            mbd.sensitivities(model, start, check_events=wrong, **settings)


def test_a_bounce_does_not_depend_on_the_size_of_steps():
    """Derivatives of a bounce had no physical meaning elsewhere, as impacts lay on the grid (brax, issue 317)."""
    model, e, g, t = ball(restitution=0.8), 0.8, 9.81, 0.9
    start = mbd.assemble(model, {"fall.displacement": 1.0})
    fall, speed = np.sqrt(2.0 / g), np.sqrt(2.0 * g)
    later, faster = 0.5 * fall, 0.5 * speed
    wanted = e * faster * (t - fall) - e * speed * later + g * (t - fall) * later
    for dt in (0.1, 0.03, 0.01):
        found = mbd.sensitivities(
            model, start, mbd.Newmark(), dt=dt, until=t, wrt=["fall.displacement"], of=["fall.displacement"]
        )
        assert found.matrix[0, 0] == pytest.approx(wanted, rel=1e-9)


def test_derivatives_in_closed_contact_are_numbers():
    """Closed, resting and just touching contacts had NaN in them elsewhere (mujoco, issues 1517, 2237, 2841)."""
    model = ball(restitution=0.0)
    for height, until in ((0.0, 0.2), (1.0, 0.6), (1.0, "floor")):
        start = mbd.assemble(model, {"fall.displacement": height}, closed=["floor"] if height == 0.0 else [])
        found = mbd.sensitivities(model, start, dt=0.01, until=until, wrt=["gravity.y", "ball.mass"])
        assert np.all(np.isfinite(found.matrix))
        if until != "floor":
            assert found["fall.displacement"] == pytest.approx([0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize(
    ("scheme", "tol"),
    [(mbd.HHT(0.05, tolerance=1e-12), 3e-6), (mbd.RungeKutta853(), 1e-7), (mbd.RadauIIA(1e-12), 1e-7)],
    ids=repr,
)  # fmt: skip
def test_steps_that_follow_a_tolerance_are_held(scheme, tol):
    """Derivatives are those of the run with its own steps, and tend to those of the motion as the tolerance falls."""
    model = pendulum()
    start = mbd.assemble(model, {"hinge.angle": 1.0})
    names = ["hinge.angle", "hinge.angle.rate", "rod.center", "gravity.y"]
    exact = mbd.sensitivities(model, start, mbd.RungeKutta853(), dt=1e-2, until=1.0, wrt=names)
    found = mbd.sensitivities(model, start, scheme, tol=tol, until=1.0, wrt=names)
    assert found.matrix == pytest.approx(exact.matrix, abs=20.0 * tol)


def test_of_the_restitution_of_a_bounce():
    model, g, t = ball(restitution=0.8), 9.81, 0.9
    start = mbd.assemble(model, {"fall.displacement": 1.0})
    speed, left = np.sqrt(2.0 * g), t - np.sqrt(2.0 / g)
    settings = {"dt": 0.01, "until": t, "of": ["fall.displacement", "fall.displacement.rate"]}
    wrt = ["floor.restitution", "fall.displacement", {"loss": {"floor.restitution": -2.0, "ball.mass": 1.0}}]
    found = mbd.sensitivities(model, start, mbd.Newmark(), wrt=wrt, **settings)
    assert found.matrix[:, 0] == pytest.approx([speed * left, speed], rel=1e-9)
    assert found.matrix[:, 2] == pytest.approx(-2.0 * found.matrix[:, 0], rel=1e-9)
    for law in ("poisson", "sequential"):  # which are one, for one contact
        other = mbd.sensitivities(model, start, mbd.Newmark(), wrt=wrt, impact=law, **settings)
        assert other.matrix == pytest.approx(found.matrix, rel=1e-12, abs=1e-12)
    with pytest.raises(mbd.CapabilityError, match="floor.restitution"):
        mbd.sensitivities(model, start, wrt=wrt, check_events={"floor.restitution": 0.1}, **settings)


def test_a_reset_by_sympy_expressions_is_differentiated():
    """v⁺ = e v² + k at the floor, from a drop by h: dv⁺/dh = 2 g e, dv⁺/de = 2 g h, dv⁺/dk = 1."""
    from sympy import symbols

    y, (M, G, E, K) = mbd.Coordinate("y", unit="m"), symbols("M G E K")
    model = mbd.Lagrangian("drop", [y], M * y.v**2 / 2, M * G * y.q, parameters={M: 1.0, G: 9.81, E: 0.2, K: 0.7})
    model.constrain(mbd.Event("floor", y.q, direction=-1, reset={y.v: E * y.v**2 + K}))
    start = mbd.assemble(model, {"y": 1.3})
    found = mbd.sensitivities(
        model, start, mbd.RungeKutta853(), 0.01, until="floor", wrt=["y", "E", "K"], of=["y.rate", "time"]
    )
    wanted = {"y": 2.0 * 9.81 * 0.2, "E": 2.0 * 9.81 * 1.3, "K": 1.0}
    for name, value in wanted.items():
        assert math.isclose(found["y.rate", name], value, rel_tol=1e-9), name


def test_a_restitution_is_refused_as_an_unknown_with_what_serves():
    model, ball = one_body(mbd.PointMass("ball", mass=2.0), mbd.Prismatic, "fall", axis="y")
    model.constrain(mbd.Unilateral("floor", mbd.height(ball.origin), restitution=0.5))
    start = mbd.assemble(model, {"fall.displacement": 1.0})
    with pytest.raises(mbd.UnknownNameError, match="'floor.restitution' is a number of the model.*wrt="):
        mbd.optimize(model, {"floor.restitution": (0.5, 0.1, 0.9)}, start=start, dt=0.01, until=0.7,
                     maximize="fall.displacement", progress=False)  # fmt: skip


@pytest.mark.parametrize("until", ["floor", "landing"])
def test_an_event_at_the_gap_of_a_contact_happens_with_it(until):
    """A fall from x: √(2 x/g) and −√(2 g x), of which e comes back."""
    model, ball = one_body(mbd.PointMass("ball", mass=2.0), mbd.Prismatic, "fall", axis="y")
    model.constrain(
        mbd.Unilateral("floor", mbd.height(ball.origin), restitution=0.5),
        mbd.Event("landing", mbd.height(ball.origin), direction=-1),
    )
    start = mbd.assemble(model, {"fall.displacement": 1.3})
    found = mbd.sensitivities(
        model, start, dt=0.01, until=until, wrt=["fall.displacement"], of=["time", "fall.displacement.rate"]
    )
    assert found["time", "fall.displacement"] == pytest.approx(math.sqrt(0.5 / 9.81 / 1.3), rel=1e-9)
    speed = 0.5 * math.sqrt(0.5 * 9.81 / 1.3)
    assert found["fall.displacement.rate", "fall.displacement"] == pytest.approx(speed, rel=1e-9)


@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.RungeKutta853(), mbd.RadauIIA()], ids=repr)
@pytest.mark.parametrize("restitution", [0.05, 0.3, 0.5])
def test_runs_have_derivatives_where_contacts_come_to_rest_by_bouncing(scheme, restitution):
    """A knee bounces on its stop, ever less, and stays; so does a ball thrown, which slides on until it sticks."""
    leg, thrown = mbd.Model("leg"), mbd.Model("thrown")
    thigh, shank = mbd.Link("thigh", 1.0, 1.0, 0.5, 0.1), mbd.Link("shank", 0.5, 0.6, 0.3, 0.02)
    knee = mbd.Revolute("knee", thigh.end, shank.start, loss=mbd.Viscous(0.05))
    leg.connect(mbd.Revolute("hip", leg.ground.origin, thigh.start, loss=mbd.Viscous(0.2)), knee)
    leg.constrain(mbd.Unilateral("stop", mbd.flexion(knee), restitution=restitution))
    ball = mbd.PointMass("ball", 1.0)
    thrown.connect(mbd.Translation("place", thrown.ground.origin, ball.origin))
    thrown.constrain(mbd.Unilateral("floor", mbd.touchdown(ball.origin), restitution=restitution, friction=0.1))
    for model, start, names, until in (
        (leg, {"hip.angle": -1.0, "knee.angle": -0.5}, ["thigh.mass", "knee.angle"], 1.25),
        (thrown, {"place.y": 0.1}, ["gravity.y", "place.y", "place.x.rate"], 1.5),
    ):
        begin = mbd.assemble(model, start, {"place.x": 1.0} if model is thrown else None)
        found = mbd.sensitivities(model, begin, scheme, dt=5e-3, until=until, wrt=names)
        last = [event for event in found.run.events if event.kind == "closed"][-1]
        assert found.run.record.closed[-1].any() and last.energy_loss < 1e-12
        assert off(found.matrix, differences(model, begin, scheme, names, dt=5e-3, until=until)[0]).max() < 1e-5
