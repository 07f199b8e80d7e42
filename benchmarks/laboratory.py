"""A gait laboratory's day: moments and postures of a person of 34 degrees of freedom, frame by frame.

Inverse dynamics is measured from arrays of angles to moments by name, beside pinocchio's `rnea` of the same tree called
frame by frame from Python, and from angles alone beside the inverse dynamics tool of OpenSim on the same person written
as `.osim`, where these are installed; inverse kinematics from 40 markers with errors of 5 mm.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

import mbd
from benchmarks.figures import Figure, interleaved
from benchmarks.people import pinocchio_tree
from benchmarks.stopwatch import processor_seconds
from mbd.compile.background import finish
from mbd.compile.mechanisms import mechanism_of
from mbd.laboratory.marker_program import marker_program

FRAMES, MARKED = 2000, 500
"""Frames of inverse dynamics, and of inverse kinematics."""
PLACES = [(0.06, -0.05, 0.08), (-0.07, -0.2, -0.05), (0.03, -0.3, 0.1)]
"""Markers on each segment [m]; 40 of them are taken."""


def _second(task: Callable[[], float]) -> float:
    """Seconds of a call right behind another one, as for trials of a session, whatever other tasks left in caches."""
    task()
    return task()


def measure(repeats: int) -> list[Figure]:
    """Microseconds of a frame."""
    person = mbd.human(70.0, 1.75)
    names = [f"{name} {k}" for name in person.bodies for k in range(len(PLACES))][:40]
    for name in names:
        segment, _, place = name.rpartition(" ")
        mbd.Marker(name, person.bodies[segment], PLACES[int(place)])
    model = mbd.Model("patient")
    model.connect(*person.joints)
    motion, recording = _motion(model, FRAMES), _recording(model, person, names)
    tasks: dict[str, Callable[[], float]] = {
        "moments": partial(processor_seconds, mbd.inverse_dynamics, model, motion),
        "postures": partial(processor_seconds, mbd.inverse_kinematics, model, recording),
    }
    coupled, part = _coupled(model, motion)
    driven = [joint.name for joint in person.joints if joint.name.split()[-1] not in ("trunk", "wrist", "ankle")]
    tasks["coupled"] = partial(processor_seconds, mbd.inverse_dynamics, coupled, part, driven)
    for task in tasks.values():
        task()
    finish()
    calls = _rnea()
    if calls is not None:
        tasks["pinocchio"] = partial(processor_seconds, calls)
    tool = _opensim_tool(model)
    if tool is not None:
        tasks["filmed"] = partial(processor_seconds, mbd.inverse_dynamics, model, _filmed(model, FRAMES))
        tasks["opensim"] = tool
    samples = interleaved({name: partial(_second, task) for name, task in tasks.items()}, repeats)
    other = samples["pinocchio"].least / FRAMES * 1e6 if calls is not None else None
    yardstick, ratio = ("", None) if other is None else ("rnea from Python", 1.2)
    moments, postures = samples["moments"], samples["postures"]
    value = moments.least / FRAMES * 1e6
    moved = samples["coupled"]
    beside = [Figure("the same with dependent motions", moved.least / FRAMES * 1e6, "µs", 20.0, spread=moved.spread)]
    if tool is not None:
        ours, theirs = (samples[name].least / FRAMES * 1e6 for name in ("filmed", "opensim"))
        spread = samples["filmed"].spread
        beside += [Figure("the same from angles alone", ours, "µs", 20.0, "OpenSim's tool", theirs, 0.01, spread)]
    return [
        Figure("inverse dynamics, a frame", value, "µs", 20.0, yardstick, other, ratio, moments.spread),
        *beside,
        Figure("inverse kinematics, a frame", postures.least / MARKED * 1e6, "µs", 1000.0, spread=postures.spread),
    ]


def _motion(model: mbd.Model, count: int) -> dict[str, np.ndarray]:
    """All coordinates with rates and accelerations."""
    equations, rng = mechanism_of(model).equations, np.random.default_rng(0)
    whole = equations.configuration
    q = whole.normalise(0.4 * rng.normal(size=(count, equations.n_q)))
    motion = {"time": np.arange(float(count))} | dict(zip(whole.names, q.T, strict=True))
    for name in equations.velocity_names:
        motion[name], motion[f"{name.removesuffix('.rate')}.acceleration"] = rng.normal(size=(2, count))
    return motion


def _coupled(model: mbd.Model, motion: dict[str, np.ndarray]) -> tuple[mbd.Model, dict[str, np.ndarray]]:
    """The person whose wrists and ankles follow elbows and knees, and the motion without these."""
    coupled = mbd.Model("coupled patient")
    coupled.connect(*model.joints)
    part = dict(motion)
    pairs = ("wrist.angle", "elbow.angle"), ("ankle.first", "knee.angle"), ("ankle.second", "knee.angle")
    for side in "left", "right":
        for own, other in pairs:
            names = f"{side} {own}", f"{side} {other}"
            follows = mbd.measure(lambda a, b: a - 0.3 * mbd.sin(b), *names, unit="rad")
            coupled.constrain(mbd.Bilateral(f"{names[0].replace('.', ' ')} follows", follows))
            for name in names[0], f"{names[0]}.rate", f"{names[0]}.acceleration":
                del part[name]
    return coupled, part


def _recording(model: mbd.Model, person: mbd.Human, names: list[str]) -> mbd.Recording:
    """A smooth motion of all joints, filmed."""
    mechanism, rng = mechanism_of(model), np.random.default_rng(1)
    time, n_v = np.arange(MARKED) / 100.0, mechanism.equations.n_v
    x = 0.2 * rng.normal(size=n_v) * np.sin(5.0 * time[:, None] + 3.0 * rng.normal(size=n_v))
    start = mbd.assemble(model, position=person.standing(0.3))
    q = mechanism.equations.configuration.compose(np.array(start.q), x)
    places, _ = marker_program(mechanism, names, [], [], []).at_all(time, q, mechanism.parameters())
    places = places + 0.005 * rng.normal(size=places.shape)
    return mbd.Recording(time, {name: places[:, 3 * k : 3 * k + 3] for k, name in enumerate(names)})


def _rnea() -> Callable[[], None] | None:
    """As many calls of `rnea` as there are frames."""
    found = pinocchio_tree()
    if found is None:
        return None
    pin, tree = found
    data, nv, rng = tree.createData(), tree.nv, np.random.default_rng(2)
    q = [pin.integrate(tree, pin.neutral(tree), each) for each in rng.normal(size=(FRAMES, nv))]
    v, a = rng.normal(size=(2, FRAMES, nv))

    def calls() -> None:
        for k in range(FRAMES):
            pin.rnea(tree, data, q[k], v[k], a[k])

    return calls


def _filmed(model: mbd.Model, count: int) -> dict[str, np.ndarray]:
    """Angles alone, of a smooth motion."""
    whole, rng = mechanism_of(model).equations.configuration, np.random.default_rng(3)
    time, n_v = np.arange(count) / 100.0, len(mechanism_of(model).equations.velocity_names)
    x = 0.2 * rng.normal(size=n_v) * np.sin(5.0 * time[:, None] + 3.0 * rng.normal(size=n_v))
    start = mbd.assemble(model)
    return {"time": time} | dict(zip(whole.names, whole.compose(np.array(start.q), x).T, strict=True))


def _opensim_tool(model: mbd.Model) -> Callable[[], float] | None:
    """Seconds of OpenSim's inverse dynamics tool, which reads as many frames of the person and writes its moments."""
    try:
        import opensim
    except ImportError:
        return None
    opensim.Logger.setLevelString("Off")
    folder = Path(mkdtemp())
    mbd.write_model(model, folder / "person.osim")
    person = opensim.Model(str(folder / "person.osim"))
    person.initSystem()
    coordinates = person.getCoordinateSet()
    names = [coordinates.get(k).getName() for k in range(coordinates.getSize())]
    rng, time = np.random.default_rng(4), np.arange(FRAMES) / 100.0
    angles = 0.2 * rng.normal(size=len(names)) * np.sin(5.0 * time[:, None] + 3.0 * rng.normal(size=len(names)))
    lines = ["\t".join(f"{value:.12g}" for value in (t, *row)) for t, row in zip(time, angles, strict=True)]
    head = f"motion\nversion=1\nnRows={FRAMES}\nnColumns={len(names) + 1}\ninDegrees=no\nendheader\n"
    (folder / "motion.sto").write_text(head + "\t".join(["time", *names]) + "\n" + "\n".join(lines) + "\n")

    def seconds() -> float:
        person = opensim.Model(str(folder / "person.osim"))
        tool = opensim.InverseDynamicsTool()
        tool.setModel(person)
        tool.setCoordinatesFileName(str(folder / "motion.sto"))
        tool.setEndTime(float(time[-1]))
        tool.setLowpassCutoffFrequency(-1.0)
        tool.setResultsDir(str(folder))
        tool.setOutputGenForceFileName("moments.sto")
        taken = processor_seconds(tool.run)
        assert (folder / "moments.sto").exists()
        return taken

    return seconds
