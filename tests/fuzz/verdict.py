"""A scene is run and judged: well, ended by an error with a name, or bad."""

import time
import traceback
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import mbd
from mbd.errors import CapabilityError, MbdError, UnknownNameError
from tests.fuzz.forms import Form, other_form
from tests.fuzz.judge import SHARE, between, judge
from tests.fuzz.scenes import STRUCTURES, Scene, scene


def verdict(number: int, structures: int = STRUCTURES, forms: bool = False) -> dict[str, Any]:
    """How the scene of a number ended, of so many mechanisms; with `forms` compared with another form of it.

    Returns
    -------
    'kind': 'ok', 'error' (of a class, 'class') or 'bad' with 'reasons'; 'message', 'scene', 'seconds', 'check'
    """
    began = time.perf_counter()
    told: dict[str, Any] = {"number": number, "kind": "ok", "reasons": [], "message": "", "scene": "", "check": ""}
    try:
        made = scene(number, structures)
        made = replace(made, check="form") if forms else made
        told |= {"scene": str(made), "check": made.check}
        told |= _judged(made)
    except MbdError as error:
        told |= {"kind": "error", "class": type(error).__name__, "message": str(error)}
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        told["reasons"] = [f"crashed: {error!r} at {Path(place.filename).name}:{place.lineno}"]
    if told["reasons"]:
        told["kind"] = "bad"
    return told | {"seconds": round(time.perf_counter() - began, 4)}


def run_of(made: Scene, **changes: Any) -> mbd.Trajectory:
    """The run of a scene, with other options where they are given."""
    options = {**made.options, **changes}
    model = options.pop("model", made.model)
    start = options.pop("start", None)
    if start is None:
        start = _assembled(made.number, made.structures, model)
    return mbd.simulate(model, start, on_failure="return", **options)


@lru_cache(maxsize=4)
def _assembled(number: int, structures: int, model: mbd.Model) -> mbd.State:
    """The start of a scene, which its comparisons share."""
    return mbd.assemble(model, **scene(number, structures).start)


def _judged(made: Scene) -> dict[str, Any]:
    run = run_of(made)
    found = judge(run, made.model, made.parameters)
    reasons = [str(fault) for fault in found.faults]
    if found.unjudged:
        reasons.append(f"not judged: {found.unjudged}")
    if run.success and not reasons and len(run) > 3:
        reasons += _compared(made, run)
    told: dict[str, Any] = {"reasons": reasons, "notes": list(map(str, run.stats["notes"])), "rows": len(run)}
    if not run.success:
        told |= {"kind": "error", "class": _class_of(run.message), "message": run.message}
    return told


def _class_of(message: str) -> str:
    """The kind of a failed run, by the first words behind the instant."""
    text = message.split(": ", 1)[-1] if message.startswith("t = ") else message
    words = [word for word in text.replace("'", " ").split() if word.isalpha()]
    return "stopped: " + " ".join(words[:3])


def _compared(made: Scene, run: mbd.Trajectory) -> list[str]:
    check = made.check
    if check in ("restart", "file"):
        return _restarted(made, run, by_file=check == "file")
    if check == "between":
        return [f"between rows: {fault}" for fault in between(run, made.model, made.parameters).faults]
    if check == "step there":
        return _step_there(made, run)
    if check == "cut":
        return _other_cut(made, run)
    if check == "form":
        return _moves_alike(made, run, other_form(made.form.number, made.model, dict(made.parameters)))
    if check == "twin":
        return _twin(made, run)
    if check == "one ulp":
        return _one_ulp(made, run)
    if check == "schemes":
        return _schemes(made, run)
    if check == "tolerance":
        return _tolerance(made, run)
    return []


def _restarted(made: Scene, run: mbd.Trajectory, by_file: bool) -> list[str]:
    """A run that is cut in two at one of its rows and goes on from there is the same, to the bit."""
    if "tol" in made.options:
        return []
    middle = len(run) // 2
    at = float(run.time[middle])
    if np.count_nonzero(run.time == at) > 1:
        return []
    first = run_of(made, until=at)
    final = first.final
    if by_file:
        with TemporaryDirectory() as folder:
            final = mbd.load(first.save(Path(folder) / "half")).final
    second = run_of(made, start=final, until=made.options["until"])
    wanted = run.record.q[-1]
    if first.success and second.success and np.array_equal(second.record.q[-1], wanted):
        return []
    dt = made.options["dt"]
    on_grid = any(abs((at - t) / dt - round((at - t) / dt)) < 1e-6 for t in (0.0, *(e.time for e in run.events)))
    off = np.max(np.abs(second.record.q[-1] - wanted)) if second.success else np.inf
    if not on_grid or run.stats.get("shortened", 0):
        return []
    return [f"cut in two at t = {at:.6g} s: the end differs by {off:.3g}"]


def _step_there(made: Scene, run: mbd.Trajectory) -> list[str]:
    """What is asked between rows is where a run that ends there ends."""
    if run.settings["contact"] == "nonsmooth" or run.record.parameter_changes:
        return []
    k = len(run) * 2 // 3
    t = float(0.6 * run.time[k - 1] + 0.4 * run.time[k])
    if t <= run.time[k - 1] or t >= run.time[k] or "tol" in made.options:
        return []
    short = run_of(made, until=t)
    if not short.success:  # an error with a name
        return []
    faults = []
    h = run.time[k] - run.time[k - 1]
    lo, hi = max(k - 4, 0), min(k + 4, len(run))
    precise = run.settings["integrator"].startswith(("Runge", "Radau"))
    for joint in made.model.joints:
        for name in joint.coordinate_names if joint.is_vector else ():
            a = run[f"{name}.acceleration"][lo:hi]
            bound = h**2 * (0.05 if precise else 1.0) * (np.ptp(a) + 1e-6 * np.max(np.abs(a))) + 1e-8 * (
                1.0 + abs(run[name][k])
            )
            off = abs(float(run.at(t)[name]) - float(short[name][-1]))
            if not off <= bound:
                faults.append(f"between rows: {name!r} at t = {t:.6g} s off by {off:.3g} from a step that ends there")
    return faults


def _other_cut(made: Scene, run: mbd.Trajectory) -> list[str]:
    """The same motion whichever joints are cut."""
    others = [cut for cut in ("auto", *made.form.cuts) if cut != made.cut]
    if not others or run.settings["contact"] == "nonsmooth":
        return []
    cut = others[made.number % len(others)]
    return _moves_alike(made, run, Form(made.form.with_cut(cut), dict(made.parameters), what=f"other cut {cut!r}"))


def _moves_alike(made: Scene, run: mbd.Trajectory, form: Form) -> list[str]:
    """The same motion in another form, within what two thirds of the step change.

    It is the step that most are taken with, which contacts shorten until a larger dt changes nothing. Half of it would
    change nothing in impacts, whose steps are dt halved until they are short enough.
    """
    names = [name for joint in made.model.joints for name in joint.coordinate_names]
    place, speed = _beginning(made.model, run)
    position, velocity, parameters = place | form.position, speed | form.velocity, form.parameters
    steps = np.diff(run.time)
    longest = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else np.inf
    changes: dict[str, Any] = (
        {"dt": min(made.options["dt"], longest) / 1.5} if "dt" in made.options else {"tol": made.options["tol"] / 4.0}
    )
    finer = run_of(made, **changes)
    if not finer.success or _happened(made, finer) != _happened(made, run):
        return []
    try:
        again = mbd.assemble(form.model, position=position, velocity=velocity, parameters=parameters, project=True)
        other = run_of(made, model=form.model, start=again)
    except (UnknownNameError, CapabilityError):  # of words that ask for the tree as it is, such as resets
        return []
    except MbdError as error:
        return [f"{form.what}: refused, {type(error).__name__}: {error}"]
    if not other.success:
        limited = "is a result, such as" in other.message  # the same, found at an event
        same = limited or run_of(made, model=form.model, start=again, **changes).success
        return [] if same else [f"{form.what}: fails, {other.message}"]
    faults = [f"{form.what}: {fault}" for fault in judge(other, form.model, parameters).faults]
    if _happened(made, other) != _happened(made, run):
        return faults
    a, b, c = (_ends(names, each, run) for each in (run, other, finer))
    allowed = (
        27.0 * (np.abs(a - c) + np.max(np.abs(a - c))) + 1e-6 * (1.0 + np.abs(a)) + 30.0 * made.options.get("tol", 0.0)
    )
    if np.all(np.abs(a - b) <= allowed):
        return faults
    near = run_of(made, model=form.model, start=again, **changes)  # its rows may err more than coordinates do
    if not near.success or _happened(made, near) != _happened(made, run):
        return faults
    allowed += 27.0 * np.abs(b - _ends(names, near, run))
    for k in np.flatnonzero(~(np.abs(a - b) <= allowed)):
        ends_at = f"{names[k]!r} ends at {b[k]:.9g} instead of {a[k]:.9g}, with 2/3 of the step at {c[k]:.9g}"
        faults.append(f"{form.what}: {ends_at}")
    return faults


def _happened(made: Scene, run: mbd.Trajectory) -> list[str]:
    """Names of the events of a run that the scene knows."""
    known = {word.name for word in (*made.model.joints, *made.model.constraints)}
    return [event.name for event in run.events if event.name in known]


def _beginning(model: mbd.Model, run: mbd.Trajectory) -> tuple[dict[str, Any], dict[str, Any]]:
    """Positions and velocities of all joints at the start of a run, by name."""
    place: dict[str, Any] = {}
    speed: dict[str, Any] = {}
    for joint in model.joints:
        for name in joint.coordinate_names:
            if ".orientation." not in name:
                place[name], speed[name] = float(run[name][0]), float(run[f"{name}.rate"][0])
        if not joint.is_vector:
            place[f"{joint.name}.orientation"] = tuple(map(float, run[f"{joint.name}.orientation"][0]))
            speed[f"{joint.name}.angular_velocity"] = tuple(map(float, run[f"{joint.name}.angular_velocity"][0]))
    return place, speed


def _ends(names: list[str], run: mbd.Trajectory, like: mbd.Trajectory) -> Any:
    """Coordinates at the end of a run, quaternions with the sign of those of another one (n,)."""
    found = np.array([float(run[name][-1]) for name in names])
    for k, name in enumerate(names):
        if name.endswith(".orientation.w"):
            other = [float(like[each][-1]) for each in names[k : k + 4]]
            found[k : k + 4] *= 1.0 if found[k : k + 4] @ other >= 0.0 else -1.0
    return found


def _twin(made: Scene, run: mbd.Trajectory) -> list[str]:
    """The first steps in plain Python are those of machine code."""
    if "tol" in made.options:
        return []
    k = min(6, len(run) - 1)
    until = _beside_events(run, float(run.time[k]))
    if until <= 0.0:
        return []
    fast, plain = (run_of(made, until=until, backend=backend) for backend in ("llvm", "python"))
    if fast.success != plain.success or _story(fast)[1] != _story(plain)[1]:
        return [f"compiled code and its twin do not have the same events until t = {until:.6g} s"]
    if len(fast) != len(plain) and not fast.events:
        return [f"compiled code has {len(fast)} rows until t = {until:.6g} s, its twin {len(plain)}"]
    same = slice(None) if len(fast) == len(plain) else slice(-1, None)  # an event just before, then a step just after
    off = np.max(np.abs(fast.record.q[same] - plain.record.q[same]), initial=0.0)
    scale = 1.0 + np.max(np.abs(fast.record.q), initial=0.0)
    h = np.diff(fast.time)
    missed = 4.0 * SHARE * h**2 @ np.max(np.abs(fast.record.a[1:]), axis=1)  # Newton's tolerance
    if len(plain.record.lam.T) and fast.settings["between"] == "hermite":  # corrections in the metric of other iterates
        missed += np.sum((h**2 * np.max(np.abs(np.diff(fast.record.a, axis=0)), axis=1)) ** 2)
    return [] if off <= 1e-9 * scale + missed else [f"compiled code and its twin differ by {off:.3g} after {k} steps"]


def _beside_events(run: mbd.Trajectory, at: float) -> float:
    """An instant, or half a step later if events happen then: whether a run that ends at one has it is round-off."""
    if all(event.time != at for event in run.events):
        return at
    times = np.unique(run.time)
    k = int(np.searchsorted(times, at))
    return float(0.5 * (times[k] + times[k + 1]) if k + 1 < len(times) else 0.5 * (times[k - 1] + times[k]))


def _one_ulp(made: Scene, run: mbd.Trajectory) -> list[str]:
    """One ulp more of every position and rate of the start changes no decision, and the end as much as it must.

    What it must is measured by a change of 10⁻¹¹ of the size of a radian or metre. Where steps follow errors, these are
    known to what Newton's method leaves, a thousandth of a step's error at most: whether it makes one more correction
    hangs on the last bit.
    """
    if made.form.loops:
        return []
    start = _assembled(made.number, made.structures, made.model)
    ends = []
    for q, v in (
        (np.nextafter(start.q, np.inf), np.nextafter(start.v, np.inf)),
        (start.q + 1e-11, start.v + 1e-11),
        (start.q - 1e-11, start.v - 1e-11),
    ):
        ends.append(run_of(made, start=replace(start, q=q, v=v, memory=None)))
    ulp, *moved = ends
    if any(not other.success or _story(other) != _story(run) for other in moved):
        return []  # the motion itself changes
    if not ulp.success or _story(ulp) != _story(run):
        return [f"one ulp more at the start: {len(ulp)} rows instead of {len(run)}, events {_story(ulp)[1][:5]}"]
    growth = max(float(np.max(np.abs(other.record.q[-1] - run.record.q[-1]))) for other in moved) / 1e-11
    off = float(np.max(np.abs(ulp.record.q[-1] - run.record.q[-1])))
    size = 1.0 + max(float(np.max(np.abs(values), initial=0.0)) for values in (run.record.q, run.record.v))
    allowed = 1e-14 * size * (1.0 + growth) * len(run) * 10.0 + 1e-3 * made.options.get("tol", 0.0)
    return [] if off <= allowed else [f"one ulp more at the start: the end differs by {off:.3g}, allowed {allowed:.1g}"]


def _story(run: mbd.Trajectory) -> tuple[int, list[tuple[str, str]]]:
    """What a run decided: its rows and its events."""
    return len(run), [(event.kind, event.name) for event in run.events]


def _schemes(made: Scene, run: mbd.Trajectory) -> list[str]:
    """Another scheme comes to the same end, within what two thirds of the step change there, and its half there.

    Steps that follow a friction are the same with two thirds of dt: where ends differ by more, those with a quarter of
    dt must differ by less than half, and none by more than its run tells or its order leaves open.
    """
    if run.settings["contact"] == "nonsmooth" or "dt" not in made.options:
        return []
    finer = run_of(made, dt=made.options["dt"] / 1.5)
    scheme = mbd.RadauIIA() if isinstance(made.options["integrator"], mbd.RungeKutta853) else mbd.RungeKutta853()
    other, near = (run_of(made, integrator=scheme, dt=made.options["dt"] / part) for part in (1.0, 1.5))
    if not (finer.success and other.success and near.success):
        return []
    if any(_story(each)[1] != _story(run)[1] for each in (finer, other, near)):
        return []
    names = [name for joint in made.model.joints for name in joint.coordinate_names]
    a, b, c, d = (_ends(names, each, run) for each in (run, finer, other, near))
    off, allowed = np.abs(a - c), 27.0 * (np.max(np.abs(a - b)) + np.max(np.abs(c - d))) + 1e-6 * (1.0 + np.abs(a))
    if np.any(off > allowed) and np.max(off) <= _left_open(made, run) + _left_open(made, other):
        finest = [run_of(made, **more, dt=made.options["dt"] / 4.0) for more in ({}, {"integrator": scheme})]
        if all(each.success for each in finest):
            left = np.abs(np.subtract(*(_ends(names, each, run) for each in finest)))
            if np.all(left <= np.maximum(0.5 * np.max(off), allowed)):
                return []
    return [
        f"schemes: {names[k]!r} ends at {a[k]:.9g}, with {scheme!r} at {c[k]:.9g}, allowed {allowed[k]:.2g}"
        for k in np.flatnonzero(~(off <= allowed))
    ]


def _left_open(made: Scene, run: mbd.Trajectory) -> float:
    """Error of the end of a run [m, rad]: what it tells of, or what accelerations change in a step of order 2."""
    if "local_errors" in run.stats:
        return float(run.stats["local_errors"]) * float(made.options["until"])
    return float(made.options["dt"]) ** 2 * float(np.max(np.ptp(run.record.a, axis=0), initial=0.0))


def _tolerance(made: Scene, run: mbd.Trajectory) -> list[str]:
    """A run with a tolerance keeps it at its end, against one of order 8 or 5 with a hundredth of it."""
    if "tol" not in made.options:
        return []
    tol = made.options["tol"]
    scheme = mbd.RadauIIA() if made.number % 2 else mbd.RungeKutta853()
    fine = run_of(made, integrator=scheme, tol=max(0.01 * tol, 1e-10))
    if not fine.success or _story(fine)[1] != _story(run)[1]:
        return []
    names = [name for joint in made.model.joints for name in joint.coordinate_names]
    off = dict(zip(names, np.abs(_ends(names, run, run) - _ends(names, fine, run)), strict=True))
    worst = max(off, key=lambda name: off[name])
    if off[worst] <= 4.0 * tol + 1e-9:
        return []
    return [f"tolerance: {worst!r} ends {off[worst]:.3g} from a finer run, tol = {tol:.3g}"]
