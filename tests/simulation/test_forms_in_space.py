"""One run in space in two forms: kept in a file, cut in two, interpreted, in a batch, between its rows."""

import json
import pickle
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import mbd
from mbd.integrators import Integrator
from mbd.joints.quaternions import rotation_of
from tests.simulation.cut_runs import PARTS, assert_halves_are_the_whole
from tests.simulation.test_many_runs import same as same_state
from tests.space_scenes import Scene, cases, scene
from tests.test_saved_runs import same

QUICK = [("tree", "cylindrical", 0), ("loop", "screw", 1), ("feet", "planar", 0)]
"""One of each kind; all other joints and seeds are slow."""
SCHEMES: tuple[Integrator, ...] = (
    mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta853(), mbd.GeneralizedAlpha(0.8), mbd.RungeKutta4(),
    mbd.HHT(0.05, formulation="index3"),
)  # fmt: skip
TIGHT: dict[Integrator, Integrator] = {
    mbd.HHT(0.05): mbd.HHT(0.05, tolerance=1e-13),
    mbd.RadauIIA(): mbd.RadauIIA(tolerance=1e-13),
    mbd.GeneralizedAlpha(0.8): mbd.GeneralizedAlpha(0.8, tolerance=1e-13),
    mbd.HHT(0.05, formulation="index3"): mbd.HHT(0.05, formulation="index3", tolerance=1e-13),
}
"""The same, whose Newton iterations go on to round-off."""
DT, UNTIL = 5e-3, 0.3


def schemes(kind: str, seed: int) -> list[tuple[Integrator, str]]:
    """Two schemes with a strategy for contacts; non-smooth steps need a scheme of steps."""
    first = SCHEMES[seed % len(SCHEMES)]
    others = [(first, "events"), (SCHEMES[(seed + 3) % len(SCHEMES)], "events")]
    return [*others, (mbd.HHT(0.05), "nonsmooth")] if kind == "feet" else others


def ran(
    made: Scene, scheme: Integrator, contact: str, start: mbd.State | None = None, **more: object
) -> mbd.Trajectory:
    """The run of a scene, which may fail."""
    how: dict[str, object] = {"dt": DT, "until": UNTIL, "contact": contact, "on_failure": "return", **more}
    if not made.model.contacts:
        del how["contact"]
    return mbd.simulate(made.model, made.start if start is None else start, scheme, **how)  # type: ignore[arg-type]


# kept and cut -------------------------------------------------------------------------------------------------------
def files(made: Scene, scheme: Integrator, contact: str, folder: Path, seed: int) -> None:
    """A run that was saved or pickled, and saved again, gives the same bits, at rows and between."""
    run = ran(made, scheme, contact)
    some = np.random.default_rng(seed).choice(run.names, 8, replace=False).tolist()
    saved = run.save(folder / "once")
    once = mbd.load(saved)
    same(run, once, some)
    assert same_state(run.final, once.final)
    with np.load(saved) as first, np.load(once.save(folder / "twice")) as second:
        assert first.files == second.files
        for name in first.files:
            np.testing.assert_array_equal(first[name], second[name], err_msg=name)
    again = pickle.loads(pickle.dumps(run))
    for part in PARTS:
        np.testing.assert_array_equal(getattr(run.record, part), getattr(again.record, part), err_msg=part)


def halves(made: Scene, scheme: Integrator, contact: str, folder: Path, seed: int) -> None:
    """A run cut in two at any row, by its final state or a file, is the same run."""
    whole = ran(made, scheme, contact)
    rng = np.random.default_rng(seed)
    rows = {int(row) for row in rng.integers(1, len(whole), 2)}
    for k, row in enumerate(sorted(rows)):
        first = ran(made, scheme, contact, until=float(whole.time[row]))
        final = first.final if k else mbd.load(first.save(folder / f"first {row}")).final
        if first.time[-1] == whole.time[-1]:
            continue
        assert_halves_are_the_whole(whole, first, ran(made, scheme, contact, final))


def texts(made: Scene, scheme: Integrator, contact: str, folder: Path, seed: int) -> None:
    """A state told by its names, as text, is assembled to itself.

    The start where planes move with time, or where index 3 leaves velocities off the rows.
    """
    moved = not made.model.contacts and "index3" not in repr(scheme)
    final = ran(made, scheme, contact).final if moved else made.start
    place = json.loads(json.dumps(dict(zip(final.names, map(float, final.q), strict=True))))
    speed = json.loads(json.dumps(dict(zip(final.velocity_names, map(float, final.v), strict=True))))
    for joint in made.model.joints:
        if joint.orientation is not None and f"{joint.name}.orientation.w" in place:
            parts = [place.pop(f"{joint.name}.orientation.{part}") for part in "wxyz"]
            place[f"{joint.name}.orientation"] = tuple(parts)
    told = {
        "closed": final.mode.closed,
        "open": [c.name for c in made.model.contacts if c.name not in final.mode.closed],
    }
    again = mbd.assemble(made.model, place, speed, parameters=final.parameters, **told)
    np.testing.assert_allclose(again.q, final.q, rtol=0, atol=1e-9)
    np.testing.assert_allclose(again.v, final.v, rtol=0, atol=1e-8)


# interpreted --------------------------------------------------------------------------------------------------------
STEPS = 12
"""How many steps around the first contact are taken in plain Python."""


def twins(made: Scene, scheme: Integrator, contact: str, folder: Path, seed: int) -> None:
    """Machine code and plain Python find the same events and rows, until a motion that amplifies the last bits."""
    tight = TIGHT.get(scheme, scheme)
    fast = ran(made, tight, contact)
    first = fast.events[0].time if fast.events else 0.0
    until = min(UNTIL, max(first - 2.0 * DT, 0.0) + STEPS * DT)
    fast, plain = (ran(made, tight, contact, until=until, backend=backend) for backend in ("llvm", "python"))
    assert (fast.success, plain.success) == (True, True), plain.message
    assert [(e.name, e.kind) for e in fast.events] == [(e.name, e.kind) for e in plain.events]
    np.testing.assert_allclose([e.time for e in fast.events], [e.time for e in plain.events], rtol=0, atol=1e-9)
    one, two = fast.record, plain.record
    np.testing.assert_array_equal(one.closed, two.closed)
    alike = np.abs(one.time - two.time) <= 1e-9
    if "slipped" in [e.kind for e in fast.events]:  # how often a step is shortened then is for Newton's method to say
        assert alike[0] and alike[-1] and np.mean(alike) > 0.8
    else:
        assert np.all(alike)
    h = np.diff(fast.time)
    swing = h**2 * np.max(np.abs(np.diff(one.a, axis=0)), axis=1, initial=0.0)
    missed = float(np.sum(swing**2)) if one.lam.shape[1] else 0.0  # positions corrected in the metric of other iterates
    for part, bound, per in (("q", 1e-9, 1.0), ("v", 1e-8, DT), ("a", 1e-6, DT**2)):
        size = float(np.max(np.abs(getattr(two, part)), initial=0.0))
        allowed = bound * (1.0 + size) + missed / per
        found, wanted = getattr(one, part)[alike], getattr(two, part)[alike]
        np.testing.assert_allclose(found, wanted, rtol=0, atol=allowed, err_msg=part)


# many ---------------------------------------------------------------------------------------------------------------
def batches(made: Scene, scheme: Integrator, contact: str, folder: Path, seed: int) -> None:
    """Runs of a batch, and of a sweep in threads, are those of `simulate`, to the bit."""
    model, how = made.model, {"dt": DT, "until": UNTIL} | ({"contact": contact} if made.model.contacts else {})
    masses = [float(model.parameters["body 0.mass"]) * part for part in (1.0, 0.9, 1.3)]
    results = ["kinetic_energy", made.start.names[-1], made.start.velocity_names[0], "body 0.center.x"]
    results += [f"{contact.name}.force" for contact in model.contacts[:2]]
    found = mbd.batch(model, [made.start] * 3, scheme, parameters={"body 0.mass": masses}, results=results, **how)
    with ThreadPoolExecutor(2) as pool:
        table = mbd.sweep(
            model, {"body 0.mass": masses}, made.start, results, integrator=scheme, executor=pool, **how
        )  # fmt: skip
    for k, mass in enumerate(masses):
        alone = mbd.simulate(model, made.start, scheme, parameters={"body 0.mass": mass}, on_failure="return", **how)
        assert found.success[k] == table["success"][k] == alone.success
        if not alone.success:
            continue
        assert same_state(found.final(k), alone.final)
        assert found.events[k] == len(alone.events)
        assert found.steps[k] == alone.stats["steps"]
        assert same_state(found.run(k).final, alone.final)
        assert [repr(event) for event in found.run(k).events] == [repr(event) for event in alone.events]
        for name in results:
            assert table[name][k] == alone[name][-1], name
            assert found.results[name][k] == pytest.approx(alone[name][-1], rel=1e-12, abs=1e-12), name


# between rows -------------------------------------------------------------------------------------------------------
def orientations(made: Scene, scheme: Integrator, contact: str, folder: Path, seed: int) -> None:
    """Between rows quaternions are of length 1, and angular velocities are how orientations turn.

    Polynomials miss the latter by what they leave out, a part of its change over a few steps; impulses of non-smooth
    steps are no motion.
    """
    if contact == "nonsmooth":
        return
    share = 1e-6 if scheme.order() > 2 else 0.05
    run = ran(made, scheme, contact)
    rows = np.flatnonzero(np.diff(run.time) > 0.5 * DT)
    rng = np.random.default_rng(seed)
    rows = rng.choice(rows, min(8, len(rows)), replace=False)
    h = run.time[rows + 1] - run.time[rows]
    times, step = run.time[rows] + rng.uniform(0.2, 0.8, len(rows)) * h, 1e-3 * h
    before, now, after = run.at(times - step), run.at(times), run.at(times + step)
    for joint in made.model.joints:
        if joint.orientation is None or f"{joint.name}.orientation.w" not in made.start.names:
            continue
        q, spin = np.array(now[f"{joint.name}.orientation"]), np.array(now[f"{joint.name}.angular_velocity"])
        np.testing.assert_allclose(np.linalg.norm(q, axis=-1), 1.0, rtol=0, atol=1e-14)
        first, last = np.array(before[f"{joint.name}.orientation"]), np.array(after[f"{joint.name}.orientation"])
        turned = np.array(
            [np.array(rotation_of(a)).T @ np.array(rotation_of(b)) for a, b in zip(first, last, strict=True)]
        )
        vector = 0.5 * (turned - np.swapaxes(turned, 1, 2))[:, [2, 0, 1], [1, 2, 0]] / (2.0 * step[:, None])
        change = np.array([np.ptp(run[f"{joint.name}.angular_velocity"][max(row - 1, 0) : row + 3]) for row in rows])
        assert np.all(np.abs(vector - spin).max(axis=1) <= share * change + 1e-8), joint.name


Law = Callable[[Scene, Integrator, str, Path, int], None]
LAWS: tuple[Law, ...] = (files, halves, texts, twins, batches, orientations)


@pytest.mark.covering
@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
@pytest.mark.parametrize(("kind", "joint", "seed"), QUICK)
def test_one_run_in_two_forms(kind, joint, seed, law, tmp_path):
    several = schemes(kind, seed)
    law(scene(kind, joint, seed), *several[LAWS.index(law) % len(several)], tmp_path, seed)


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
@pytest.mark.parametrize(("kind", "joint", "seed"), cases(range(3)))
def test_one_run_of_every_joint_in_two_forms(kind, joint, seed, law, tmp_path):
    made = scene(kind, joint, seed)
    for scheme, contact in schemes(kind, seed):
        law(made, scheme, contact, tmp_path, seed)
