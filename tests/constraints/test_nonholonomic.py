"""Rows on velocities: words, equations, tangents, every way they meet the other parts."""

import pickle

import numpy as np
import pytest
import sympy

import mbd
from mbd.equations import derive
from mbd.equations.programs import constraint_jacobian
from tests.cases.sleighs import Sleigh, blade_row, rolling_wheel, tractor
from tests.equations.numbers import at, inputs
from tests.helpers import assert_second_order

NAMES = ("body.x.rate", "body.y.rate", "body.angle")
SLEIGH = Sleigh(mass=1.7, inertia=0.31, ahead=-0.23, pull=0.9)


def skater(bias=0.0, **options) -> mbd.Model:
    """A free disk with one row of the user's own."""
    model = mbd.Model("skater", gravity=(0.0, 0.0, 0.0))
    disk = mbd.RigidBody("disk", 2.0, (0.1, 0.1, 0.2))
    model.connect(mbd.Planar("body", model.ground.origin, disk.origin))
    options = {"row": lambda vx: vx, "arguments": ("body.x.rate",)} | options
    model.constrain(mbd.Nonholonomic("belt", bias=bias, **options))
    return model


SCENES = {
    "sleigh": SLEIGH.model,
    "sleigh by hand": lambda: SLEIGH.model(by_hand=True),
    "sleigh of energies": SLEIGH.energies,
    "tractor": tractor,
    "tractor with a cut hitch": lambda: tractor(["hitch"]),
    "tractor, all cut": lambda: tractor("all"),
    "wheel on a row": lambda: rolling_wheel(2.0, 0.3, 0.09, 0.3, 9.81),
    "wheel on a contact": lambda: rolling_wheel(2.0, 0.3, 0.09, 0.3, 9.81, "contact"),
    "moving belt": lambda: skater(lambda t: mbd.sin(3.0 * t), row=lambda vx, x: (1 + x**2) * vx,
                                  arguments=("body.x.rate", "body.x")),
}  # fmt: skip


# equations ----------------------------------------------------------------------------------------------------------


def test_a_blade_and_the_same_row_by_hand_are_one_row():
    found = []
    for scene in "sleigh", "sleigh by hand", "sleigh of energies":
        equations = derive(SCENES[scene]())
        point = inputs(equations, 3)
        found.append(at([equations.rows[0].rate, *constraint_jacobian(equations, [0])[0]], point))
    np.testing.assert_allclose(found[1], found[0], atol=1e-15)
    np.testing.assert_allclose(found[2], found[0], atol=1e-15)


def test_a_row_may_be_a_sympy_expression():
    vx, vy, angle = sympy.symbols("vx vy angle")
    arguments = {"vx": NAMES[0], "vy": NAMES[1], "angle": NAMES[2]}
    row = vx * sympy.sin(angle) - vy * sympy.cos(angle)
    model = skater(row=row, arguments=list(arguments.items()))
    assert mbd.assemble(model, velocity={"body.x": 1.0}).moved == {}
    assert mbd.assemble(model, position={"body.angle": 0.5}, velocity={"body.x": 1.0}).v[1] == pytest.approx(
        np.tan(0.5)
    )


def test_rows_on_velocities_are_printed_as_such():
    text = skater(0.7).equations()
    assert "rows without h hold velocities: B v + b = 0" in text
    assert "B[belt, body.x] = 1" in text and "b[belt] = belt.bias" in text and "h[" not in text
    assert "b_{" in skater(0.7).equations(latex=True)
    assert "belt: Nonholonomic, on the velocities of 'body.x.rate'" in skater().describe()


# what is refused ----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("row", "arguments", "said"),
    [
        (lambda vx: vx * vx, NAMES[:1], "not linear in velocities"),
        (lambda vx: abs(vx), NAMES[:1], "not linear in velocities"),
        (lambda vx, vy: vx * vy, NAMES[:2], "not linear in velocities"),
        (lambda vx, vy: mbd.sqrt(vx**2 + vy**2), NAMES[:2], "not linear in velocities"),
        (lambda angle: mbd.sin(angle), NAMES[2:], "holds no velocity"),
        (lambda vx: 0.0 * vx + 1.0, NAMES[:1], "holds no velocity"),
        (lambda vx: vx, ("boddy.x.rate",), "did you mean 'body.x.rate'"),
    ],
)
def test_a_row_that_is_none_is_told(row, arguments, said):
    with pytest.raises(mbd.ModelError, match=said):
        derive(skater(row=row, arguments=arguments))


@pytest.mark.parametrize(
    ("row", "said"),
    [
        (lambda q_rate: q_rate**2, "the row 'r' is not linear in rates"),
        (lambda q: q, "no rate enters the row 'r'"),
        (lambda q_rat: q_rat, "did you mean 'q_rate'"),
    ],
)
def test_a_row_of_energies_that_is_none_is_told(row, said):
    system = mbd.Lagrangian("mass", ["q"], kinetic=lambda q_rate: q_rate**2, nonholonomic={"r": row})
    assert said in system.check()[0]


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda f: mbd.Nonholonomic("row", lambda v: v), "say which rates enter"),
        (lambda f: mbd.Nonholonomic("row", 3.0, arguments=NAMES), "function or a sympy expression"),
        (lambda f: mbd.Nonholonomic("row", lambda v: v, arguments=NAMES, unit="deg"), "'m' or 'rad'"),
        (lambda f: mbd.Nonholonomic("row", lambda v: v, bias="fast", arguments=NAMES), "bias of 'row'"),
        (lambda f: mbd.KnifeEdge("edge", "frame"), "must be a frame"),
        (lambda f: mbd.KnifeEdge("edge", f, normal=(0, 0, 0)), "must not be zero"),
        (lambda f: mbd.Rolling("tyre", f, float("nan")), "finite"),
        (lambda f: mbd.Rolling("tyre", f, 0.3, ground=lambda x: x), "mbd.Plane"),
        (lambda f: mbd.Rolling("tyre", f, 0.3, ground=mbd.Plane((0, 1, 1))), "x-y plane"),
    ],
)
def test_a_word_that_makes_no_sense_is_told_at_once(make, said):
    with pytest.raises(mbd.ModelError, match=said):
        make(mbd.PointMass("hub", 1.0).origin)


def test_faults_of_the_description():
    model = skater()
    model.constrain(mbd.KnifeEdge("edge", model.ground.origin), mbd.Rolling("tyre", model.ground.origin, -0.3))
    said = " ".join(model.check())
    assert "'edge' is on the ground" in said and "center on the ground" in said and "-0.3 m is not positive" in said


def test_a_disk_that_tilts_is_refused_by_name():
    model = mbd.Model("disk")
    hub, disk = mbd.RigidBody("hub", 1.0, (1, 1, 1)), mbd.RigidBody("disk", 1.0, (1, 1, 2))
    model.connect(mbd.Revolute("lean", model.ground.origin, hub.origin, axis=(1, 0, 0)))
    model.connect(mbd.Revolute("axle", hub.origin, disk.origin))
    model.constrain(mbd.Rolling("tyre", disk.origin, 0.3))
    with pytest.raises(mbd.CapabilityError, match="'tyre' serves wheels of planar mechanisms"):
        derive(model)


# starts -------------------------------------------------------------------------------------------------------------
def test_a_start_is_completed_in_velocity_and_keeps_its_place():
    model = SLEIGH.model()
    start = mbd.assemble(model, position={"body.angle": 0.4, "body.x": 3.0}, velocity={"body.x": 1.0})
    assert start.q.tolist() == [3.0, 0.0, 0.4]
    assert start.v[1] == pytest.approx(np.tan(0.4))


def test_a_start_that_slips_is_told_with_its_speed():
    with pytest.raises(mbd.AssemblyError, match=r"contradicts 'blade': velocity residual -1 m/s"):
        mbd.assemble(SLEIGH.model(), velocity={"body.x": 2.0, "body.y": -1.0, "body.angle": 1.0})
    moved = mbd.assemble(SLEIGH.model(), velocity={"body.x": 2.0, "body.y": -1.0, "body.angle": 1.0}, project=True)
    assert moved.v[1] == pytest.approx(0.0) and moved.v[0] == pytest.approx(2.0)


def turning_tractor(cut="auto") -> tuple[mbd.Model, mbd.State]:
    """The tractor and a start that is the same for every cut."""
    model = tractor(cut)
    position = {"body.x": 0.0, "body.y": 0.0, "body.angle": 0.3, "hitch.angle": -0.5}
    return model, mbd.assemble(model, position=position, velocity={"body.x.rate": 0.6, "body.angle.rate": 1.1})


# runs ---------------------------------------------------------------------------------------------------------------
SCHEMES = {
    "newmark": mbd.Newmark(),
    "hht": mbd.HHT(0.05, tolerance=1e-13),
    "generalized alpha": mbd.GeneralizedAlpha(0.8, tolerance=1e-13),
    "hht index 3": mbd.HHT(0.05, formulation="index3", tolerance=1e-13),
    "generalized alpha index 3": mbd.GeneralizedAlpha(0.5, formulation="index3", tolerance=1e-13),
}
every_scheme = pytest.mark.parametrize("scheme", SCHEMES)


@every_scheme
def test_rows_of_both_kinds_together_keep_second_order(scheme):
    """Against the tractor in tree coordinates, extrapolated from small steps."""
    model, start = turning_tractor(["hitch"])
    tree, begin = turning_tractor()
    names = ("body.x", "body.angle", "hitch.angle", "body.angle.rate", "front blade.force", "back blade.force")
    fine = [mbd.simulate(tree, begin, mbd.GeneralizedAlpha(0.9), dt=dt, until=2.0) for dt in (2e-4, 1e-4)]
    reference = np.array([(4 * fine[1][name][-1] - fine[0][name][-1]) / 3 for name in names])

    def errors(dt: float) -> list[float]:
        run = mbd.simulate(model, start, SCHEMES[scheme], dt=dt, until=2.0)
        assert max(np.abs(run[f"{end} blade.residual"]).max() for end in ("front", "back")) < 1e-10
        assert np.abs(run["hitch.x.residual"]).max() < 1e-10
        found = np.array([run[name][-1] for name in names])
        return [float(np.linalg.norm((found - reference)[:4])), float(np.linalg.norm((found - reference)[4:]))]

    assert_second_order(errors, 0.01)


def test_a_row_driven_in_time_does_work_and_its_bias_is_a_parameter():
    """v_x = −b(t) on a mass m: force −m ḃ, work ½ m (b² − b₀²)."""
    model = skater(lambda t: -mbd.sin(3.0 * t))
    run = mbd.simulate(model, mbd.assemble(model), mbd.GeneralizedAlpha(0.9), dt=1e-3, until=1.0)
    assert run["body.x.rate"][-1] == pytest.approx(np.sin(3.0), abs=1e-12)
    assert run["belt.force"][-1] == pytest.approx(6.0 * np.cos(3.0), abs=1e-4)
    assert run.energy.sums["belt"] == pytest.approx(np.sin(3.0) ** 2, abs=1e-5)
    model = skater(-0.5)
    assert model.parameters["belt.bias"] == -0.5
    start = mbd.assemble(model, parameters={"belt.bias": -0.8})
    assert start.v[0] == pytest.approx(0.8)
    with pytest.warns(mbd.MbdWarning, match="accelerations jump at every sample"):
        sampled = skater(mbd.Samples([0.0, 0.5, 1.0], [-1.0, -2.0, -2.0], kind="linear"))
    run = mbd.simulate(sampled, mbd.assemble(sampled), dt=1e-2, until=1.0)
    assert run["body.x"][-1] == pytest.approx(0.75 + 1.0, abs=1e-4)


def test_a_row_on_turning_has_a_torque():
    model = skater(-2.0, row=lambda w: w, arguments=("body.angle.rate",), unit="rad")
    model.apply(mbd.Applied("push", next(iter(model.bodies["disk"].frames.values())), torque=3.0))
    run = mbd.simulate(model, mbd.assemble(model), dt=1e-2, until=1.0)
    assert run["body.angle"][-1] == pytest.approx(2.0)
    assert run["belt.force"] == pytest.approx(-3.0)
    assert "rad" in derive(model).rows[0].unit


def test_an_impact_leaves_the_blade_without_slip():
    """The sleigh runs into a wall: the impulses of wall and blade together keep v⁺ on the blade."""
    model = SLEIGH.model()
    nose = model.bodies["sleigh"].point(0.5, 0.1, name="nose")
    model.constrain(mbd.Unilateral("wall", mbd.touchdown(nose, mbd.Plane((-1, 0, 0), -1.0)), friction=0))
    start = SLEIGH.start(model, 0.3, 1.0, 0.2)
    run = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.8), dt=1e-3, until=1.5)
    event = next(event for event in run.events if event.kind == "closed")
    after = event.row
    assert np.abs(run["blade.residual"]).max() < 1e-10
    assert np.abs(run["wall.gap_rate"][after]) < 1e-10
    before = after - 1
    assert run["kinetic_energy"][after] < run["kinetic_energy"][before]
    lost = run["kinetic_energy"][before] - run["kinetic_energy"][after]
    assert event.energy_loss == pytest.approx(lost, rel=1e-9)


@pytest.mark.parametrize("twice", ["blades", "place and rate"])
def test_rows_that_say_the_same_are_noted_and_share_the_force(twice):
    model = SLEIGH.model()
    body = model.bodies["sleigh"]
    if twice == "blades":
        model.constrain(mbd.KnifeEdge("second", body.origin))
    else:
        model = skater()
        model.constrain(mbd.Bilateral("slot", mbd.measure("body.x")))
        model.apply(mbd.Applied("push", model.bodies["disk"].origin, force=(4.0, 1.0)))
    start = mbd.assemble(model, velocity={"body.angle": 1.0})
    run = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.8), dt=1e-2, until=1.0)
    assert any("redundant" in note for note in run.stats["notes"])
    if twice == "blades":
        np.testing.assert_allclose(run["second.force"], run["blade.force"], atol=1e-9)
        assert np.abs(run["second.residual"]).max() < 1e-10
    else:
        assert run["belt.force"] == pytest.approx(-2.0)
        assert np.abs(run["belt.residual"]).max() < 1e-10


def pendulum_held_twice(second: str) -> tuple[mbd.Model, mbd.State]:
    """A point on a circle, which a second row says again."""
    model = mbd.Model("twice")
    bob = mbd.PointMass("bob", 1.0)
    model.connect(mbd.Translation("bob place", model.ground.origin, bob.origin))
    model.constrain(mbd.Bilateral("rod", mbd.distance(model.ground.origin, bob.origin), 1.0))
    places = ("bob place.x", "bob place.y")
    if second == "velocity":
        rates = tuple(f"{place}.rate" for place in places)
        row = mbd.Nonholonomic("again", lambda x, y, vx, vy: x * vx + y * vy, arguments=(*places, *rates))
    else:
        row = mbd.Bilateral("again", mbd.measure(lambda x, y: x * x + y * y, *places), 1.0)
    model.constrain(row)
    return model, mbd.assemble(model, position={"bob place.x": 1.0})


@pytest.mark.parametrize("second", ["position", "velocity"])
@pytest.mark.parametrize("scheme", ["hht", "hht index 3"])
def test_a_row_said_twice_does_not_restart_the_scheme(scheme, second):
    """In index 3 the rates of rows on positions are of the size of its error; those that depend on them share it."""
    model, start = pendulum_held_twice(second)
    run = mbd.simulate(model, start, SCHEMES[scheme], dt=1e-2, until=2.0)
    assert run.stats["restarts"] == 1
    assert any("'again' depends on " in note for note in run.stats["notes"])
    assert run["bob place.y"].min() == pytest.approx(-1.0, abs=1e-4)
    assert np.abs(run["rod.residual"]).max() < 1e-10
    assert np.abs(run["again.residual"]).max() < (1e-10 if second == "position" or scheme == "hht" else 2e-3)


def test_a_model_with_rows_on_velocities_pickles():
    model = skater(row=blade_row, arguments=NAMES)
    again = pickle.loads(pickle.dumps(model))
    assert [word.name for word in again.nonholonomic] == ["belt"]
    assert again.nonholonomic[0].mentions() == list(NAMES)


def test_positions_are_reported_apart_from_slip():
    model, start = turning_tractor(["hitch"])
    violation = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.8), dt=1e-2, until=0.5).violation
    assert violation.worst.startswith("hitch") and violation.length < 1e-12 and violation.rate < 1e-10
    model = SLEIGH.model()
    start = SLEIGH.start(model, 0.3, 1.0, 0.2)
    violation = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.8), dt=1e-2, until=0.5).violation
    assert violation.length == 0.0 and 0.0 < violation.rate < 1e-10
