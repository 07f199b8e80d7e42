"""The study of effects: what is absent costs nothing, what does nothing changes nothing, what it advises holds."""

import csv
from importlib.util import find_spec

import numpy as np
import pytest

import mbd
from mbd import cli
from mbd.analysis.effects import lab, timing
from mbd.analysis.effects.comparison import common
from mbd.analysis.effects.contribution import Change
from mbd.analysis.effects.scenes import Scene, reduced
from mbd.errors import ModelError, UnknownNameError
from mbd.results.trajectory import EventRecord
from tests.equations import mechanisms
from tests.helpers import one_body

OUTPUTS = ("hip.angle", "knee.angle")


@pytest.fixture(autouse=True, scope="module")
def quick():
    """Nothing here judges times."""
    patch = pytest.MonkeyPatch()
    for name, value in (("MIN_ROUNDS", 2), ("MAX_ROUNDS", 2)):
        patch.setattr(timing, name, value)
    patch.setattr(lab, "STEPS", (50, 50))
    yield
    patch.undo()


POSE = {"position": {"hip.angle": 0.5, "knee.angle": -0.3}, "velocity": {"knee.rate": 1.0}}


def leg() -> tuple[mbd.Model, mbd.State]:
    """A double pendulum with effects that matter, a weak one, and two that never act."""
    model = mbd.Model("leg")
    thigh = mbd.Link("thigh", mass=1.0, length=0.5, center=0.2, inertia=0.02)
    shank = mbd.Link("shank", mass=0.5, length=0.5, center=0.2, inertia=0.01)
    hip = mbd.Revolute("hip", model.ground.origin, thigh.start, loss=mbd.Viscous(1e-5))
    knee = mbd.Revolute("knee", thigh.end, shank.start, stiffness=2.0, loss=mbd.Viscous(0.1))
    model.connect(hip, knee)
    model.apply(
        mbd.Motor("late push", hip, torque=lambda t: mbd.where(t < 50.0, 0.0, 1.0)),
        mbd.Motor("drive", hip, torque=lambda t: 0.5 * mbd.sin(4.0 * t)),
        mbd.Spring("thread", model.ground.point(0.0, -2.0), shank.end, stiffness=2e-4, length=0.5),
    )
    model.constrain(mbd.Penalty("far stop", mbd.flexion(knee, offset=-50.0), stiffness=500.0, damping=2.0))
    return model, mbd.assemble(model, **POSE)


def rail() -> mbd.Model:
    """A mass on a spring along a rail with a viscous and a dry part."""
    model = mbd.Model("rail", gravity=(0.0, 0.0, 0.0))
    mass = mbd.PointMass("mass", mass=1.0)
    loss = mbd.Viscous(0.1) + mbd.Coulomb(0.5)
    model.connect(mbd.Prismatic("rail", model.ground.origin, mass.origin, loss=loss, stiffness=20.0))
    return model


@pytest.fixture(scope="module")
def found() -> mbd.Effects:
    model, start = leg()
    return mbd.effects(model, start, 1.0, dt=2e-3, outputs=OUTPUTS, tolerance=1e-3)


def test_every_effect_that_cost_lists_is_studied(found):
    model, _ = leg()
    cost = model.cost()
    assert [each.name for each in found.contributions] == [*cost.effects, "far stop"]
    kinds = {each.name: each.kind for each in found.contributions}
    assert kinds == {
        "gravity": "gravity", "hip loss": "joint loss", "knee spring": "potential", "knee loss": "joint loss",
        "late push": "motor", "drive": "motor", "thread": "potential", "far stop": "penalty",
    }  # fmt: skip


def test_an_absent_effect_costs_no_operation(found):
    """What an effect takes is what goes with it; without all of them nothing of them is left."""
    model, _ = leg()
    cost = model.cost()
    always = [each for each in found.contributions if each.acts == "always"]
    for each in always:
        assert each.operations > 0 and model.without(each.name).cost().newton == cost.newton - each.operations
        assert each.name not in model.without(each.name).cost().effects
    bare = model.without(*(each.name for each in always)).cost()
    assert bare.effects == {} and found.shared >= 0
    assert cost.newton - bare.newton == sum(each.operations for each in always) + found.shared
    without = model.without("far stop").cost()
    assert without.newton == cost.newton and without.guards < cost.guards


@pytest.mark.parametrize("make", [mechanisms.leg, rail], ids=["leg", "rail"])
def test_whatever_cost_lists_can_be_left_out(make):
    model = make()
    cost = model.cost()
    penalties = [contact.name for contact in model.contacts if isinstance(contact, mbd.Penalty)]
    for name in (*cost.effects, *cost.frictions, *penalties):
        left = model.without(name).cost()
        assert name not in {**left.effects, **left.frictions, **left.contacts}
    with pytest.raises(UnknownNameError, match="without: no joint, loss, force or constraint named 'gravitas'"):
        model.without("gravitas")


@pytest.mark.parametrize("name", ["late push", "far stop"])
def test_an_effect_that_does_nothing_changes_no_bit(found, name):
    model, _ = leg()
    each = found[name]
    assert each.change.identical and each.change.largest == 0.0 and each.energy == 0.0
    runs = [mbd.simulate(s, mbd.assemble(s, **POSE), dt=2e-3, until=1.0) for s in (model, model.without(name))]
    for part in ("time", "q", "v", "a", "lam"):
        first, second = (getattr(run.record, part) for run in runs)
        assert first.tobytes() == second.tobytes()
    np.testing.assert_array_equal(runs[0].energy["knee loss"], runs[1].energy["knee loss"])
    assert any("nothing in this run, to the bit" in line and name in line for line in found.recommendation)


def test_what_the_study_leaves_out_stays_within_the_tolerance(found):
    model, _ = leg()
    assert {"hip loss", "late push", "thread", "far stop"} == set(found.droppable)
    assert found.together is not None and found.together.change.within(1e-3)
    rest = model.without(*found.droppable)
    run = mbd.simulate(rest, mbd.assemble(rest, **POSE), dt=2e-3, until=1.0)
    for name in OUTPUTS:
        scale = float(np.ptp(found.run[name]))
        change = float(np.max(np.abs(run[name] - found.run[name]))) / scale
        assert change <= 1e-3
        assert change == pytest.approx(found.together.change.outputs[name], rel=0.02, abs=1e-9)
    assert found.together.operations == model.without(*found.droppable).cost().newton


def test_what_matters_is_not_left_out(found):
    for name in "gravity", "knee spring", "knee loss", "drive":
        assert found[name].change.largest > 1e-2 and name not in found.droppable
    assert sum(each.share for each in found.contributions) == pytest.approx(1.0)
    assert found["knee loss"].energy == pytest.approx(-found.run.energy["knee loss"][-1], rel=1e-9)


def test_together_they_may_be_too_many():
    """Each of three threads changes little; all of them more than is allowed: the strongest is put back."""
    model, start = leg()
    shank = model.joints[1].child.body
    for k in range(2):
        pull = mbd.Spring(f"thread {k}", model.ground.point(0.0, -2.0), shank.end, 2e-4 * (k + 1), length=0.5)
        model.apply(pull)
    probe = mbd.effects(model, start, 1.0, dt=2e-3, outputs=OUTPUTS, tolerance=1.0)
    tolerance = 1.05 * probe["thread 1"].change.largest
    found = mbd.effects(model, start, 1.0, dt=2e-3, outputs=OUTPUTS, tolerance=tolerance)
    assert found.together is not None and found.together.back
    assert found.together.change.within(tolerance)
    assert "had to stay" in "".join(found.recommendation)


def test_a_scene_that_falls_is_compared_until_there():
    """Without its spring an inverted pendulum falls: the run ends by that event, and the effect must stay."""
    model = mbd.Model("mast")
    mast = mbd.Link("mast", mass=1.0, length=1.0, center=0.5, inertia=0.1)
    pin = mbd.Revolute("pin", model.ground.origin, mast.start, stiffness=30.0, rest=np.pi, loss=mbd.Viscous(0.5))
    model.connect(pin)
    model.constrain(mbd.Event("fall", mbd.measure(lambda p: p[1] - 0.2, mast.end), terminal=True))
    start = mbd.assemble(model, position={"pin.angle": np.pi + 0.1})
    found = mbd.effects(model, start, 4.0, dt=2e-3, outputs="pin.angle")
    spring = found["pin spring"].change
    assert spring.ends.startswith("ended by 'fall'") and spring.differs_at == spring.until < 4.0
    assert not spring.within(1e9) and found["pin loss"].change.comparable
    text = repr(found)
    assert "without 'pin spring': ended by 'fall' at t =" in text and "Without 'pin spring' the run ends other" in text


def test_dry_friction_is_an_effect_beside_the_loss():
    """Of a rail friction alone, and the whole loss, can be left out."""
    model = rail()
    start = mbd.assemble(model, position={"rail.displacement": 0.5})
    found = mbd.effects(model, start, 2.0, dt=2e-3)
    assert {each.name: each.acts for each in found.contributions} == {
        "rail spring": "always", "rail loss": "always", "rail friction": "while sliding",
    }  # fmt: skip
    bare, smooth = model.without("rail loss"), model.without("rail friction")
    assert bare.joints[0].loss is None and smooth.joints[0].losses()[0][2].smooth is not None
    assert smooth.parameters["rail loss.viscous.coefficient"] == 0.1
    books = mbd.simulate(smooth, start, dt=2e-3, until=2.0).energy
    assert [part.name for part in books.parts] == ["rail loss"]
    friction, whole = found["rail friction"], found["rail loss"]
    assert whole.energy > friction.energy > 0.0 and friction.change.largest > 0.1


def test_friction_of_a_contact_can_be_left_out_alone():
    model, block = one_body(mbd.PointMass("block", mass=1.0), mbd.Translation, "block at")
    model.constrain(mbd.Unilateral("floor", mbd.touchdown(block.origin), friction=0.3))
    start = mbd.assemble(model, closed="floor", velocity={"block at.x": 1.0})
    slides = model.without("floor friction")
    assert slides.constraints[0].friction == 0.0 and model.constraints[0].friction == 0.3
    found = mbd.effects(model, start, 0.5, dt=2e-3, outputs="block at.x")
    assert found["floor friction"].change.comparable  # 'stuck' is no event of a scene without friction
    assert found["floor friction"].energy == pytest.approx(0.5, rel=1e-3)
    assert found["gravity"].change.differs_at == pytest.approx(1.0 / (0.3 * 9.81), rel=1e-3)  # it never stops


def test_a_friction_that_had_its_joint_cut_is_left_out_from_the_same_place():
    model = mbd.Model("pendulum")
    rod = mbd.Link("rod", mass=1.0, length=0.5, center=0.5)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.PinFriction(0.3, 0.02)))
    start = mbd.assemble(model, position={"pin.angle": 1.0}, velocity={"pin.rate": -0.5})
    run = mbd.simulate(model, start, dt=2e-3, until=0.1)
    scene = reduced(Scene(model, start, {}), run, ["pin friction"], "auto")
    assert scene.start.names == ("pin.angle",) != start.names
    assert scene.start["pin.angle"] == pytest.approx(1.0) and scene.start["pin.rate"] == pytest.approx(-0.5)
    found = mbd.effects(model, start, 0.1, dt=2e-3)
    assert found.outputs == ("pin.angle",) and found["pin friction"].change.comparable
    assert (
        "rod floating.x"
        in mbd.effects(model, start, 0.1, dt=2e-3, outputs="rod floating.x")["pin friction"].change.failure
    )


@pytest.mark.parametrize("loss", [mbd.Viscous(0.1), mbd.PinFriction(0.3, 0.02)])
def test_machines_go_on_from_where_they_are_without_an_effect(loss):
    model, rod = mbd.Model("arm", gravity=(0.0, 0.0, 0.0)), mbd.Link("rod", mass=1.0, length=0.5, center=0.5)
    pin = mbd.Revolute("pin", model.ground.origin, rod.start, loss=loss)
    model.connect(pin)
    model.apply(mbd.Motor("first", pin, torque=0.1), mbd.Motor("second", pin, torque=0.2))
    ways = [mbd.Transition("a", "b", after=0.07), mbd.Transition("b", "a", after=0.11)]
    model.constrain(mbd.Mode("phase", ("a", "b"), transitions=ways, remembers={"turned": "pin.angle"}, start="b"))
    model.constrain(mbd.SampledLaw("law", 0.03, {"first.torque": lambda q: -q}, arguments=("pin.angle",)))
    run = mbd.simulate(model, mbd.assemble(model, {"pin.angle": 1.0}), dt=2e-3, until=0.25)
    scene = reduced(
        Scene(model, run.final, {}), run, ["pin friction" if run.final.names != ("pin.angle",) else "second"], "auto"
    )
    assert scene.start.names == ("pin.angle",)
    other = mbd.simulate(scene.model, scene.start, dt=2e-3, until=0.3)
    for name in ("phase", "phase.time", "phase.turned", "first.torque"):
        assert other[name][0] == run[name][-1]
    assert [(e.name, round(e.time, 9)) for e in other.events] == [
        ("law: sample", 0.27),
        ("phase: b to a", 0.29),
        ("law: sample", 0.3),
    ]


def test_the_start_is_kept_to_the_bit():
    model, start = leg()
    run = mbd.simulate(model, start, dt=2e-3, until=0.1)
    scene = reduced(Scene(model, run.final, {"far stop.damping": 1.0}), run, ["far stop", "drive"], "auto")
    assert scene.start.q.tobytes() == run.final.q.tobytes() and scene.start.v.tobytes() == run.final.v.tobytes()
    assert scene.start.memory is None and scene.parameters == {} and scene.start.time == run.final.time


def event(time: float, name: str) -> EventRecord:
    return EventRecord(time, "closed", name)


def test_events_are_shared_until_one_has_another():
    mine = [event(0.1, "a"), event(0.2, "b"), event(0.2, "c"), event(0.5, "a"), event(0.9, "b")]
    theirs = [event(0.11, "a"), event(0.21, "c"), event(0.21, "b"), event(0.6, "b")]
    pairs, differs = common(mine, theirs)
    assert pairs == [(0.1, 0.11), (0.2, 0.21), (0.2, 0.21)] and differs == 0.5
    assert common(mine, mine)[1] is None and common([], [])[1] is None
    assert common(mine, mine[:4])[1] == 0.9


def test_an_event_of_the_same_name_much_later_is_another_one():
    """A foot that slips and sticks again at once, and slips much later; in the whole scene it slips only then."""
    mine = [event(0.05, "a"), event(0.07, "slip"), event(0.08, "b"), event(0.6, "slip")]
    theirs = [event(0.05, "a"), event(0.07, "b"), event(0.6, "slip")]
    for first, second in (mine, theirs), (theirs, mine):
        assert common(first, second) == ([(0.05, 0.05)], 0.07)


def test_what_is_hardly_compared_is_not_left_out():
    assert Change({"hip.angle": 0.0}, until=1.0, event_time=0.3, left_out=0.3).within(1e-3)
    assert not Change({"hip.angle": 0.0}, until=1.0, event_time=0.9, left_out=0.9).within(1e-3)


def test_an_output_that_is_no_number_without_an_effect_is_no_small_change():
    """A stop keeps the angle below 0.5, and with it under the root of what is observed."""
    model, _ = one_body(mbd.Link("rod", 1.0, length=1.0, center=1.0), mbd.Revolute, "pin")
    model.constrain(mbd.Penalty("stop", mbd.measure(lambda a: 0.45 - a, "pin.angle", unit="rad"), stiffness=1e4))
    model.observe("room", lambda a: 1.0 + 1e-9 * mbd.sqrt(0.5 - a), "pin.angle")
    start = mbd.assemble(model, {"pin.angle": -0.6})
    one = mbd.effects(model, start, 2.0, dt=5e-3, outputs=["room"])
    [stop] = [each for each in one.contributions if each.name == "stop"]
    assert stop.change.largest == np.inf and not stop.change.within(1e-3)


def test_bad_input_is_answered_at_once():
    model, start = leg()
    with pytest.raises(UnknownNameError, match=r"no output named 'hop.angle'; did you mean 'hip.angle'"):
        mbd.effects(model, start, 0.1, outputs=["hop.angle"])
    for tolerance in 0.0, -1e-3, float("nan"), "small":
        with pytest.raises(ModelError, match="tolerance must be a positive part of an output's range"):
            mbd.effects(model, start, 0.1, tolerance=tolerance)
    with pytest.raises(ModelError, match="outputs is empty"):
        mbd.effects(model, start, 0.1, outputs=[])
    with pytest.raises(ModelError, match="has no option 'store'"):
        mbd.effects(model, start, 0.1, store=2)
    with pytest.raises(ModelError, match="start must be a State"):
        mbd.effects(model, {"hip.angle": 0.1}, 0.1)
    free = mbd.Model("free", gravity=(0.0, 0.0, 0.0))
    free.connect(mbd.Prismatic("rail", free.ground.origin, mbd.PointMass("mass", mass=1.0).origin))
    with pytest.raises(ModelError, match="'free' has no effects"):
        mbd.effects(free, mbd.assemble(free), 0.1)
    with pytest.raises(UnknownNameError, match="no effect named 'hip los'; did you mean 'hip loss'"):
        mbd.effects(model, start, 0.01)["hip los"]


def test_an_effect_that_a_controller_needs_cannot_be_left_out():
    model, start = leg()
    valve = mbd.Controller("valve", lambda t, reads, state: {"knee loss.coefficient": 0.1}, period=0.1,
                           writes="knee loss.coefficient")  # fmt: skip
    model.apply(valve)
    found = mbd.effects(model, start, 0.2, dt=2e-3, outputs=OUTPUTS)
    assert found["knee loss"].change.failure and "knee loss" not in found.droppable
    assert "without 'knee loss': cannot be left out:" in repr(found)


def test_a_textbook_problem_has_effects():
    import sympy

    x = mbd.Coordinate("x", "m")
    model = mbd.Lagrangian(
        "oscillator", [x], 0.5 * x.v**2, potential=2.0 * x.q**2, dissipation=0.05 * x.v**2,
        forces={x: sympy.Float(0.3)},
    )  # fmt: skip
    found = mbd.effects(model, mbd.assemble(model, position={"x": 0.2}), 1.0, dt=5e-3)
    assert {each.name for each in found.contributions} == {"potential", "dissipation", "x force"}


def test_tables_and_bars(found, tmp_path):
    rows = list(csv.DictReader(found.to_csv(tmp_path / "effects.csv").open(encoding="utf-8")))
    assert [row["effect"] for row in rows] == [each.name for each in found.contributions]
    assert float(rows[0]["change of hip.angle"]) == pytest.approx(found["gravity"].change.outputs["hip.angle"])
    pytest.importorskip("matplotlib")
    figure = found.plot(tmp_path / "effects.png")
    assert len(figure.axes) == 3 and (tmp_path / "effects.png").stat().st_size > 10000
    pytest.importorskip("pandas")
    assert len(found.to_dataframe()) == len(rows)


def test_an_interrupted_study_tells_what_it_has(monkeypatch):
    model, start = leg()
    calls = []

    def interrupted(progress_share: float, total: float) -> None:
        calls.append(progress_share)
        if progress_share >= 3.0:
            raise KeyboardInterrupt

    found = mbd.effects(model, start, 0.1, dt=2e-3, outputs=OUTPUTS, progress=interrupted)
    assert not found.complete and len(found.contributions) == 3 and found.together is None
    assert "interrupted" in repr(found) and calls == [0.0, 1.0, 2.0, 3.0]


SCRIPT = """
import mbd
model = mbd.Model("swing")
rod = mbd.Link("rod", mass=1.0, length=0.5, center=0.5)
model.connect(mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.Viscous(1e-6)))
start = mbd.assemble(model, position={"pin.angle": 0.5})
dt, until = 2e-3, 0.5
"""


def test_the_command_prints_the_table_and_writes_files(tmp_path, capsys, monkeypatch):
    (tmp_path / "swing.py").write_text(SCRIPT, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert cli.main(["effects", "swing.py", "--output", "pin.angle"]) == 0
    said = capsys.readouterr().out
    assert "pin loss" in said and "Leave out 'pin loss'" in said and "ns/step" in said
    files = {"effects.csv", "effects.html", *({"effects.png"} if find_spec("matplotlib") else ())}
    assert {file.name for file in (tmp_path / "mbd-runs" / "swing").iterdir()} == files
    assert cli.main(["effects", "swing.py", "--until", "0"]) == 1
    assert "until must be after the start at 0 s" in capsys.readouterr().err
    assert cli.main(["effects", "swing.py", "--tolerance", "0"]) == 1
    assert "tolerance must be a positive" in capsys.readouterr().err
    assert cli.main(["effects", "swing.py", "--output", "pin.angel"]) == 1
    assert "did you mean 'pin.angle'" in capsys.readouterr().err
