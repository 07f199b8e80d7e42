"""The judge of fuzzed scenes agrees with the library on sound runs, and sees each kind of wrong one."""

import json
import sys

import numpy as np
import pytest

import mbd
from mbd.bodies import algebra
from mbd.equations import kinematics
from mbd.joints.losses.viscous import Viscous
from mbd.results.columns import ModelColumns
from tests.fuzz import batch, forms
from tests.fuzz.bodies import mass_of
from tests.fuzz.forms import Form
from tests.fuzz.geometry import Signal, inverse, product, shift, turn, twist
from tests.fuzz.judge import between, judge
from tests.fuzz.scenes import STRUCTURES, scene
from tests.fuzz.structures import DRIVEN, SPACE, structure
from tests.fuzz.verdict import run_of, verdict
from tests.helpers import altered

SOUND = {
    "each kind": (2, 10, 12, 40, 68, 98, 112, 128, 138),
    "cut screws, welds and point masses": (23, 19, 1328, 2523, 27153),
    "a stop that bounces to rest": (4, 8164),
    "a foot in index 3 with uneven steps": (2159,),
    "rows whose round-off is larger than their terms predict": (2473, 3433),
    "two steps of a quarter of the run; a flight without any error but round-off": (4378, 30308),
    "joints between long steps, in index 3, under a tolerance, over a turn of a radian": (
        4644,
        21327,
        15227,
        6994,
        19480,
    ),
    "a stiff penalty between long steps": (22904,),
    "places that long steps correct onto the rows of cut hinges": (26404, 12577),
    "steps of RadauIIA that converge slowly": (22940,),
    "a cut weld in index 3": (32593,),
    "a scheme of first order": (32503,),
    "a coarse step of the twin; a last row that is an event": (33555, 45761),
    "one more correction that hangs on the last bit": (30070,),
    "errors of one cut that cancel by the end": (10250,),
    "a last step on a penalty, behind an impact": (802878,),
    "cut hinges at 60 rad/s, from rest": (842260,),
    "a loop between rows next to a pose in which they lose rank": (801581,),
}
"""Numbers of sound scenes that were once called bad."""


def laws_broken(run, model, parameters=None):
    return {fault.law for fault in judge(run, model, parameters).faults}


def arm(**change):
    """A mass that slides along a turning arm, with a loss in the hinge."""
    model = mbd.Model("arm", **change)
    boom, slider = mbd.Link("boom", 1.3, 1.1, 0.4, 0.1), mbd.RigidBody("slider", 0.7, 0.05, center=(0.1, 0.2, 0.0))
    model.connect(
        mbd.Revolute("hinge", model.ground.origin, boom.start, loss=mbd.Viscous(0.3)),
        mbd.Prismatic("track", boom.point(0.1, -0.3), slider.origin, axis=(0, 1, 0), stiffness=30.0, rest=0.2),
    )
    return model


def swung(model, **options):
    start = mbd.assemble(model, position={"hinge.angle": 1.0}, velocity={"hinge.angle": 4.0})
    return mbd.simulate(model, start, dt=5e-3, until=0.5, **options)


def skidding():
    """A mass that falls on a floor and skids."""
    model, ball = mbd.Model("ball"), mbd.PointMass("ball", 1.3)
    model.connect(mbd.Translation("flight", model.ground.origin, ball.origin))
    model.constrain(mbd.Unilateral("floor", mbd.touchdown(ball.origin), friction=0.3, restitution=0.5))
    start = mbd.assemble(model, position={"flight.y": 0.01}, velocity={"flight.x": 2.0})
    return model, mbd.simulate(model, start, dt=1e-3, until=0.2)


def four_bar():
    model = mbd.Model("four-bar")
    a, b, c = (mbd.Link(name, 1.0, 1.0, 0.5, 0.1) for name in ("crank", "coupler", "rocker"))
    model.connect(
        mbd.Revolute("one", model.ground.origin, a.start), mbd.Revolute("two", a.end, b.start),
        mbd.Revolute("three", b.end, c.end), mbd.Revolute("four", model.ground.point(1.2, 0.0), c.start),
    )  # fmt: skip
    start = mbd.assemble(model, position={"one.angle": 0.4}, velocity={"one.angle": 2.0})
    return model, mbd.simulate(model, start, mbd.RungeKutta853(), dt=1e-2, until=0.5)


# sound runs ----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.RadauIIA(), mbd.RungeKutta853()], ids=repr)
def test_a_sound_run_breaks_no_law(scheme):
    run = swung(arm(), integrator=scheme)
    assert judge(run, arm()).faults == ()
    assert len(judge(run, arm()).tried) >= 9


def test_impacts_friction_and_loops_of_sound_runs_break_no_law():
    model, run = skidding()
    found = judge(run, model)
    assert found.faults == () and "sliding friction is all of it" in found.tried
    model, run = four_bar()
    assert judge(run, model).faults == () and "joint holds its frames together" in judge(run, model).tried
    assert between(run, model).faults == ()


@pytest.mark.sampled(5)
@pytest.mark.parametrize("number", [number for numbers in SOUND.values() for number in numbers])
def test_fuzzed_scenes_are_judged_sound(number):
    told = verdict(number)
    assert told["kind"] == "ok", told


@pytest.mark.parametrize(
    ("number", "structures"),
    [
        pytest.param(24824, 100_000, id="an impact beside a foot that sticks to a belt takes energy from it"),
        pytest.param(1025213, 100_000, id="GeneralizedAlpha(0) keeps half of an error from step to step"),
        pytest.param(8030023, 100_000, id="what Newton's method leaves of heavy bodies at a light one, with rows"),
        pytest.param(1020127, 100_000, id="and in a tree"),
        pytest.param(9021151, 160, id="and after larger forces"),
        pytest.param(21415, 100_000, id="shares of dependent frictions that follow loads in a circle"),
    ],
)
def test_scenes_of_other_numbers_of_mechanisms_are_judged_sound(number, structures):
    told = verdict(number, structures)
    assert told["kind"] == "ok" or (number == 9021151 and not told["reasons"]), told


def test_the_rows_of_a_run_that_ends_at_a_contact_without_a_force_keep_the_laws():
    """A foot that sticks whatever its force, in index 3: neither closed nor open; the row before has its forces."""
    told = verdict(24029)
    assert told["kind"] == "error", told


def test_bodies_of_scenes_in_space_may_be_made():
    """Half the trace less the tensor is a second moment of mass: no moment exceeds the sum of the other two."""
    for number in range(SPACE, SPACE + 400):
        model = structure(number).model
        for body in model.bodies.values():
            if body is not model.ground:
                inertia = mass_of(body, model.parameters).inertia
                assert np.linalg.eigvalsh(0.5 * np.trace(inertia) * np.eye(3) - inertia)[0] > -1e-15, number


def test_a_scene_is_made_again_from_its_number():
    one, two = scene(25), scene(25)
    assert str(one) == str(two) and one.start == two.start and one.model is two.model
    assert scene(25 + STRUCTURES).form is one.form
    assert scene(25 + STRUCTURES, structures=100_000).form.number == 25 + STRUCTURES


@pytest.mark.slow
@pytest.mark.parametrize("part", range(20))
def test_twenty_thousand_fuzzed_scenes_break_no_law(part):
    numbers = [n for n in range(20000) if n % STRUCTURES % 20 == part]
    told = batch.run_batch(sorted(numbers, key=lambda n: (n % STRUCTURES, n)))
    bad = [v for v in told if v["kind"] == "bad"]
    assert not bad, batch.summary(bad)
    assert len(told) == len(numbers)


def test_placements_are_differentiated_in_time():
    def moved(t):
        first = Signal(*(np.array([x]) for x in (np.sin(2 * t), 2 * np.cos(2 * t), -4 * np.sin(2 * t))))
        second = Signal(*(np.array([x]) for x in (t**2, 2 * t, 2.0)))
        return product(
            turn((0.6, 0.0, 0.8), first), inverse(product(shift((0, 1, 0), second), turn((1, 0, 0), second)))
        )

    h, now = 1e-4, moved(0.7)
    before, after = moved(0.7 - h), moved(0.7 + h)
    np.testing.assert_allclose(now.first, (after.H - before.H) / (2 * h), atol=1e-6)
    np.testing.assert_allclose(now.second, (after.first - before.first) / (2 * h), atol=1e-6)
    np.testing.assert_allclose(twist(now).linear, now.first[:, :3, 3])


# planted faults ------------------------------------------------------------------------------------------------------
def swung_arm():
    return arm(), swung(arm())


PLANTED = {
    "a wrapped angle": (
        swung_arm, ("q", np.s_[60:, 0], lambda q: q - 2.0 * np.pi), {"a coordinate is the integral of its rate"},
    ),
    "a contact that pulls": (skidding, ("lam", (-1, 0), lambda lam: 30.0), {"a closed contact does not pull"}),
    "a contact that is open inside": (skidding, ("q", (1, 1), lambda y: -1e-5), {"an open contact is outside"}),
    "friction with a wrong sign": (
        skidding, ("lam", (-1, 1), lambda lam: -lam), {"friction opposes sliding", "balance of forces"},
    ),
    "an impact that gives energy": (
        skidding, ("v", None, lambda v: 20.0 * v),
        {"an impact makes no energy", "an impact rebounds with its restitution"},
    ),
    "a row off its constraint": (four_bar, ("q", (30, 1), lambda q: q + 1e-5), {"joint holds its frames together"}),
}  # fmt: skip
"""A scene, what is changed in its stored run (None: its speeds along y from the first impact on), and broken laws."""


@pytest.mark.parametrize("fault", PLANTED)
def test_a_fault_in_stored_rows_is_seen(fault):
    make, (column, where, change), laws = PLANTED[fault]
    model, run = make()
    where = np.s_[run.events[0].row :, 1] if where is None else where
    assert laws <= laws_broken(altered(run, column, where, change), model)


@pytest.mark.parametrize(
    ("scheme", "step"), [(mbd.RungeKutta853(), {"dt": 1e-2}), (mbd.RadauIIA(), {"tol": 1e-3})], ids=repr
)
def test_a_wrong_reaction_between_rows_is_seen(scheme, step, monkeypatch):
    """A tolerance excuses none where nothing is stiff."""
    model, _ = four_bar()
    start = mbd.assemble(model, position={"one.angle": 0.4}, velocity={"one.angle": 2.0})
    run = mbd.simulate(model, start, scheme, until=0.5, **step)
    assert between(run, model).faults == ()
    right = ModelColumns.between

    def wrong(self, places, *forces):
        rows = right(self, places, *forces)
        rows.lam[:] *= 1.001
        return rows

    monkeypatch.setattr(ModelColumns, "between", wrong)
    assert "balance of torques" in {fault.law for fault in between(run, model).faults}
    assert judge(run, model).faults == ()


def test_joints_between_steps_of_index_3_come_apart_as_their_velocities_lead(monkeypatch):
    model, start = four_bar()[0], {"one.angle": 0.4}
    start = mbd.assemble(model, position=start, velocity={"one.angle": 20.0})
    run = mbd.simulate(model, start, mbd.HHT(0.3, formulation="index3"), dt=2e-2, until=0.5)
    joints = lambda: [f for f in between(run, model).faults if f.law == "joint holds its frames together"]  # noqa: E731
    assert joints() == []
    right = ModelColumns.between

    def wrong(self, places, *forces):
        rows = right(self, places, *forces)
        rows.q[:, 0] += 0.2
        return rows

    monkeypatch.setattr(ModelColumns, "between", wrong)
    assert len(joints()) == 1


def test_a_joint_assembled_half_a_turn_off_is_seen():
    model, run = four_bar()
    other = mbd.Model("turned")
    other.ground = model.ground
    last = model.joints[3]
    other.connect(*model.joints[:3], mbd.Revolute(last.name, last.parent, last.child.turned(np.pi)))
    assert "joint holds its frames together" in laws_broken(run, other)


def test_energy_that_a_loss_gives_is_seen(monkeypatch):
    right = Viscous.force
    monkeypatch.setattr(Viscous, "force", lambda self, *given: -right(self, *given))
    model = arm()
    assert {"balance of torques", "a passive part gives no energy"} <= laws_broken(swung(model), model)


def test_a_missed_event_is_seen():
    model = arm()
    run = swung(model)
    model.constrain(mbd.Event("passing", mbd.measure(lambda q: q - 1.1, "hinge.angle", unit="rad")))
    assert laws_broken(run, model) == {"an event happens where its guard crosses zero"}


def test_a_coriolis_term_with_a_wrong_sign_is_seen(monkeypatch):
    monkeypatch.setattr(
        kinematics, "scaled", lambda s, v: algebra.scaled(-s if isinstance(s, float) and s == 2.0 else s, v)
    )
    model = arm()
    run = swung(model)
    assert "balance of forces" in laws_broken(run, model)


def test_parameters_are_those_of_the_run():
    model = arm()
    run = swung(model, parameters={"slider.mass": 1.9})
    assert laws_broken(run, model, {"slider.mass": 1.9}) == set()
    assert "balance of forces" in laws_broken(run, model)


# batches -------------------------------------------------------------------------------------------------------------
def test_a_worker_that_dies_or_never_ends_costs_one_scene(tmp_path, monkeypatch):
    script = tmp_path / "worker.py"
    script.write_text(
        "import json, os, sys, time\n"
        "for n in json.load(sys.stdin):\n"
        "    os._exit(3) if n == 2 else time.sleep(60) if n == 4 else None\n"
        "    print(json.dumps({'number': n, 'kind': 'ok', 'reasons': [], 'scene': '', 'seconds': 0.0}), flush=True)\n"
    )
    monkeypatch.setattr(batch, "COMMAND", [sys.executable, str(script)])
    told = batch.run_batch([1, 2, 3, 4, 5], limit=2.0)
    assert [v["kind"] for v in told] == ["ok", "bad", "ok", "bad", "ok"]
    assert "died with code 3" in told[1]["message"] and "no end after 2 s" in told[3]["message"]
    assert "3 ok, 0 error, 2 bad" in batch.summary(told)


def test_the_command_writes_a_summary(tmp_path, capsys):
    out = tmp_path / "verdicts.jsonl"
    batch.main(["--scenes", "2:3", "--out", str(out)])
    assert "1 scenes: 1 ok" in capsys.readouterr().out
    assert json.loads(out.read_text())["number"] == 2


# joints that turn freely ---------------------------------------------------------------------------------------------
QUICK_IN_SPACE = [2, 4, 5, 6, 8003348, 8001148]
"""A redundant loop, a foot, a disk, a rolling disk; a foot that lets go as its force falls to zero; one that shares its
load with a ball joint."""


@pytest.mark.parametrize("number", [*QUICK_IN_SPACE, *(pytest.param(k, marks=pytest.mark.slow) for k in range(7, 60))])
def test_scenes_in_space_are_sound(number):
    told = verdict(SPACE + number)
    assert told["kind"] != "bad", told


def test_the_judge_sees_what_is_wrong_in_space():
    made = scene(SPACE + 13)
    run, model = run_of(made), made.model
    place = run.names.index("float.orientation.x") - run.names.index("float.x")
    assert not judge(run, model, made.parameters).faults
    bent = altered(run, "q", np.s_[3:, place], lambda right: right + 1e-3)
    assert "a quaternion has length 1" in laws_broken(bent, model, made.parameters)
    turned = altered(run, "v", np.s_[:, 4], lambda right: right + 0.1)
    assert "an orientation is the integral of its angular velocity" in laws_broken(turned, model, made.parameters)


# drives, rest, exact zeros -------------------------------------------------------------------------------------------
QUICK_DRIVEN = [1, 2, 6, 12]
"""A linkage, forces in time, watched contacts, zeros."""


@pytest.mark.parametrize("number", [*QUICK_DRIVEN, *(pytest.param(k, marks=pytest.mark.slow) for k in range(13, 60))])
def test_driven_scenes_are_sound(number):
    told = verdict(DRIVEN + number)
    assert told["kind"] != "bad", told


def test_the_judge_sees_accelerations_that_alternate_around_those_of_a_drive():
    made = scene(DRIVEN + 41)
    run, model = run_of(made), made.model
    assert not judge(run, model, made.parameters).faults
    place = [c.name for c in run.record.equations.coordinates].index("main.angle")
    wrong = altered(run, "a", np.s_[3::2, place], lambda right: right + 0.2 * np.max(np.abs(right)))
    assert "a drive gives its acceleration" in laws_broken(wrong, model, made.parameters)


FORMS = [8, 10000501, 10020026, 8030121]
"""Masses in another unit; a driven table, turned, in halves and beside others; a raised plane; a frame and a ball."""


@pytest.mark.parametrize("number", FORMS)
def test_scenes_move_alike_in_other_forms(number):
    told = verdict(number, 100_000, forms=True)
    assert told["kind"] == "ok", told


def test_a_form_that_moves_in_another_way_is_seen(monkeypatch):
    monkeypatch.setattr(Form, "gravity", lambda form: np.array([0.0, -9.0, 0.0]))
    monkeypatch.setattr(forms, "CHANGES", {"turned": forms.CHANGES["turned"]})
    assert "turned: " in verdict(FORMS[0], 100_000, forms=True)["reasons"][0]


def test_a_form_that_is_refused_where_its_scene_runs_is_reported(monkeypatch):
    def without_mass(rng, form):
        found = form.changed()
        found.model.connect(mbd.Revolute("loose", found.model.ground.origin, mbd.PointMass("nothing", 0.0).origin))
        return found

    monkeypatch.setattr(forms, "CHANGES", {"without mass": without_mass})
    (reason,) = verdict(FORMS[0], 100_000, forms=True)["reasons"]
    assert "without mass: refused, ModelError: " in reason


@pytest.mark.parametrize("given", [("--scenes", "30000000:30000001"), ("--space", "--scenes", "9000000:9000001")])
def test_numbers_of_scenes_that_would_be_of_another_kind_are_refused(given, capsys):
    with pytest.raises(SystemExit):
        batch.main(given)
    assert "the rest are others" in capsys.readouterr().err
