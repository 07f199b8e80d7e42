"""A humanoid tree of 32 and a person of 34 degrees of freedom in space, in flight and on two feet.

Steps of generalized-α with exact tangents, beside one call of pinocchio's `computeABADerivatives` for the same tree
where that is installed (the extra `peers`): the derivatives alone, without a step.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from functools import cache, partial
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import mbd
from benchmarks.compiling import python_loop
from benchmarks.figures import BURST, Figure, Samples, interleaved
from benchmarks.stopwatch import kernel_watched, processor_seconds
from mbd.compile.background import finish
from mbd.compile.mechanism import Mechanism
from mbd.equations import programs
from mbd.equations.cost import operations
from mbd.equations.derivation import derive
from mbd.kernel.contact.active_set import ActiveSetManager

DT, STEPS = 1e-3, 200
CALLS = 200
"""Of pinocchio in one repeat."""
RATIO = 0.5
COLD, CACHED = 2.0, 0.1
SCHEME = mbd.GeneralizedAlpha(rho_inf=0.9)


def _connected(name: str) -> tuple[mbd.Model, Any]:
    person, model = mbd.human(70.0, 1.75), mbd.Model(name)
    model.connect(*person.joints)
    return model, person


def _flying() -> mbd.Model:
    return _connected("in flight")[0]


def _standing() -> mbd.Model:
    """Both feet held on the ground, by 12 rows."""
    model, person = _connected("on two feet")
    for side in ("left", "right"):
        foot, hip = person.bodies[f"{side} foot"], person.bodies["pelvis"].points[f"pelvis.{side} hip"]
        place = model.ground.point(0.0, 0.0, hip.offset[2], name=f"{side} place")
        model.connect(mbd.Weld(f"{side} stance", place, foot.points[f"{side} foot.sole"]))
    return model


@cache
def flight() -> tuple[mbd.Model, mbd.State]:
    """With every joint in motion."""
    model, person = _connected("in flight")
    rates = [f"{joint.name}.{each.name}" for joint in person.joints for each in joint.freedoms]
    return model, mbd.assemble(model, person.standing(0.4), {name: 0.3 + 0.02 * k for k, name in enumerate(rates)})


@cache
def on_two_feet() -> tuple[mbd.Model, mbd.State]:
    """As the knees give way."""
    model = _standing()
    return model, mbd.assemble(model, mbd.human(70.0, 1.75).standing(0.4), {"left knee.angle": -0.2})


def measure(repeats: int) -> list[Figure]:
    """Operations, steps, and what comes before the first one."""
    return [*_counts(), *_steps(repeats), *_making(repeats)]


def _counts() -> list[Figure]:
    found = []
    for name, make in (("in flight", _flying), ("on two feet", _standing)):
        equations = derive(make())
        rows = ActiveSetManager(equations).active_rows(())
        tangent = operations(programs.newton(equations, programs.ActiveSet(rows)))
        found.append(Figure(f"person {name}: tangent, stabilized", tangent, "ops"))
    return found


def _kernel_seconds(made: Callable[[], tuple[mbd.Model, mbd.State]], steps: int) -> float:
    with kernel_watched() as watch:
        mbd.simulate(*made(), SCHEME, dt=DT, until=steps * DT, store=10 * steps)
    return watch.seconds


def _steps(repeats: int) -> list[Figure]:
    scenes = {"34 dof in flight": flight, "34 dof + 12 rows on two feet": on_two_feet}
    tasks: dict[str, Callable[[], float]] = {}
    for name, made in scenes.items():
        tasks |= {f"{name}: {n}": partial(_kernel_seconds, made, n) for n in (STEPS // 10, STEPS)}
    derivatives = _of_pinocchio()
    if derivatives is not None:
        tasks["pinocchio"] = partial(processor_seconds, derivatives)
    samples = interleaved(tasks, BURST * repeats)
    other = samples["pinocchio"].least / CALLS * 1e6 if derivatives is not None else None
    return [_step(f"step, person, {name}", samples, name, other) for name in scenes]


def _step(title: str, samples: Mapping[str, Samples], name: str, other: float | None) -> Figure:
    long, short = samples[f"{name}: {STEPS}"], samples[f"{name}: {STEPS // 10}"]
    value = (long.least - short.least) / (STEPS - STEPS // 10) * 1e6
    aim = None if other is None else RATIO if "flight" in name else 1.0
    yardstick = "" if other is None else "pinocchio's derivatives"
    return Figure(title, value, "µs", None, yardstick, other, aim, spread=long.spread)


def pinocchio_tree() -> tuple[Any, Any] | None:
    """The module of pinocchio and the tree of the person in flight; None where it is not installed."""
    try:
        import pinocchio as pin
    except ImportError:
        return None
    tree, held = pin.Model(), {}
    for joint in mbd.human(70.0, 1.75).joints:
        at, parent = pin.SE3(np.eye(3), np.array(joint.parent.offset)), held.get(joint.parent.body.name, 0)
        for k, kind in enumerate(_kinds(pin, joint)):
            parent = tree.addJoint(parent, kind, at if k == 0 else pin.SE3.Identity(), f"{joint.name} {k}")
        body: Any = joint.child.body
        held[body.name] = parent
        solid = pin.Inertia(body.mass, np.array(body.center.offset), np.diag(body.inertia))
        tree.appendBodyToJoint(parent, solid, pin.SE3.Identity())
    return pin, tree


def _of_pinocchio() -> Callable[[], None] | None:
    """Calls of `computeABADerivatives` for that tree."""
    found = pinocchio_tree()
    if found is None:
        return None
    pin, tree = found
    data, nv = tree.createData(), tree.nv
    q, v = pin.integrate(tree, pin.neutral(tree), np.linspace(-0.3, 0.4, nv)), np.linspace(-1.0, 1.0, nv)

    def calls() -> None:
        for _ in range(CALLS):
            pin.computeABADerivatives(tree, data, q, v, np.zeros(nv))

    return calls


def _kinds(pin: Any, joint: Any) -> list[Any]:
    """Its joints for one of ours."""
    if isinstance(joint, mbd.Free):
        return [pin.JointModelFreeFlyer()]
    if isinstance(joint, mbd.Spherical):
        return [pin.JointModelSpherical()]
    if isinstance(joint, mbd.Universal):
        return [pin.JointModelRZ(), pin.JointModelRX()]
    return [pin.JointModelRZ() if joint.axis[2] else pin.JointModelRX()]


def _make(folder: str, wait: bool = False) -> None:
    """From the words to code that steps, with the cache in a folder; of mechanisms in space without the kernel.

    wait : until it is optimized, as in the background of a run
    """
    before = os.environ.get("MBD_CACHE")
    os.environ["MBD_CACHE"] = folder
    try:
        mechanism = Mechanism(derive(_flying()))
        mechanism.stepping(programs.ActiveSet(ActiveSetManager(mechanism.equations).active_rows(())))
        if wait:
            finish()
    finally:
        del os.environ["MBD_CACHE"]
        if before is not None:
            os.environ["MBD_CACHE"] = before


def _cold() -> float:
    with TemporaryDirectory(ignore_cleanup_errors=True) as empty:
        return processor_seconds(_make, empty)


def _making(repeats: int) -> list[Figure]:
    with TemporaryDirectory(ignore_cleanup_errors=True) as full:
        _make(full, wait=True)
        tasks: dict[str, Callable[[], float]] = {
            "Python loop": partial(processor_seconds, python_loop),
            "cold": _cold,
            "from cache": partial(processor_seconds, _make, full),
        }
        samples = interleaved(tasks, min(repeats, 3))
    loop = samples.pop("Python loop").least
    aims = {"cold": COLD, "from cache": CACHED}
    return [
        Figure(
            f"person: derive + compile, {name}", taken.least, "s", aims[name], "Python loop", loop, spread=taken.spread
        )
        for name, taken in samples.items()
    ]
