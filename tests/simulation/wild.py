"""Wild scenes: everything a model may have, with absurd steps, masses and speeds, each made from a seed.

A scene has a shape, which decides its equations, and numbers. Many scenes share a shape, so that its equations are
derived and compiled once.
"""

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.errors import ModelError
from mbd.integrators import Integrator
from mbd.results.trajectory import Trajectory
from tests.simulation.wild_shapes import SHAPES, Shape

SCHEMES: tuple[Integrator, ...] = (
    mbd.HHT(0.05), mbd.HHT(0.3), mbd.GeneralizedAlpha(0.9), mbd.GeneralizedAlpha(0.0), mbd.GeneralizedAlpha(1.0),
    mbd.Newmark(), mbd.Newmark(0.3025, 0.6), mbd.HHT(0.1, formulation="index3"),
    mbd.GeneralizedAlpha(0.5, formulation="index3"), mbd.HHT(0.05, start="consistent"),
)  # fmt: skip
INTERPRETED: tuple[Integrator, ...] = (mbd.HHT(0.05, form="averaged"), mbd.HHT(0.3, form="averaged"))
"""Schemes that run in Python, for a few steps only."""


@dataclass(frozen=True)
class WildScene:
    """What to hand to `mbd.assemble` and `mbd.simulate`.

    Attributes
    ----------
    seed : what it was made from
    model : of its shape, shared with other scenes
    start : arguments of `mbd.assemble`
    integrator, dt, until : of the run [s]
    options : further arguments of `mbd.simulate`
    """

    seed: int
    model: Any
    start: Mapping[str, Any] = field(repr=False)
    integrator: Integrator
    dt: float
    until: float
    options: Mapping[str, Any]

    def run(self) -> Trajectory:
        """Assemble and simulate; raises what the user would see, a run that fails comes with success False."""
        start = mbd.assemble(self.model, project=True, **self.start)
        options: dict[str, Any] = dict(self.options)
        return mbd.simulate(
            self.model, start, self.integrator, dt=self.dt, until=self.until, on_failure="return", **options
        )


@lru_cache(maxsize=8)
def _shape(number: int) -> Shape | ModelError:
    """The shape of a number; a model that cannot be is kept as its error."""
    rng = random.Random(f"shape {number}")
    try:
        return SHAPES[number % len(SHAPES)](rng)
    except ModelError as error:
        return error


def wild_scene(seed: int, shapes: int = 120, interpreted: Sequence[Integrator] = INTERPRETED) -> WildScene:
    """A scene of one of so many shapes; scenes whose seeds are equal modulo `shapes` share one.

    Parameters
    ----------
    interpreted : schemes that run in Python, used for every eighth scene

    Raises
    ------
    ModelError
        where the shape itself is refused.
    """
    shape = _shape(seed % shapes)
    if isinstance(shape, ModelError):
        raise shape
    rng = random.Random(f"numbers {seed}")
    slow = rng.random() < 0.12 and len(interpreted) > 0
    scheme = rng.choice(list(interpreted if slow else SCHEMES))
    dt = 10.0 ** (rng.uniform(-7, 1) if rng.random() < 0.5 else rng.uniform(-4, -1.5))
    steps = 10.0 ** rng.uniform(0.5, 1.3 if slow else 3.0)
    options: dict[str, Any] = {
        "contact": rng.choice(["auto", "events", "nonsmooth"]),
        "impact": rng.choice(["newton", "poisson", "sequential"]),
        "locate": rng.choice(["root", "root", "root", "linear"]),
        "rest_speed": rng.choice([1e-6, 1e-6, 1e-6, 0.0, 1e-3]),
    }
    refused = options["contact"] == "nonsmooth" and rng.random() < 0.9
    if slow or refused:
        options["locate"] = "root"  # that pair is refused; roughly located bounces may be thousands, long in Python
    changed = _masses(rng, shape.model) if rng.random() < 0.5 else {}
    start = {**_start(rng, shape), "parameters": changed}
    return WildScene(seed, shape.model, start, scheme, dt, dt * steps, options)


def _masses(rng: random.Random, model: Any) -> dict[str, float]:
    """Masses over twelve decades, of one body or of all; stiffness and friction too."""
    known: Mapping[str, float] = model.parameters
    heavy = [name for name in known if name.endswith((".mass", ".inertia")) and known[name] > 0.0]
    every = rng.random() < 0.4
    picked = heavy if every else rng.sample(heavy, min(1, len(heavy)))
    changed = {name: known[name] * 10.0 ** rng.uniform(-6, 6) for name in picked}
    other = [name for name in known if name.endswith((".stiffness", ".mu", ".torque", ".damping")) and known[name] > 0]
    for name in rng.sample(other, min(len(other), rng.randint(0, 1))):
        changed[name] = known[name] * 10.0 ** rng.uniform(-3, 3)
    return changed


def _start(rng: random.Random, shape: Shape) -> dict[str, Any]:
    """A posture near that of the shape, and rates of any size."""
    equations = mechanism_of(shape.model).equations
    spread, speed = rng.choice([0.0, 0.0, 0.01, 0.3]), rng.choice([0.0, 1.0, 10.0 ** rng.uniform(-6, 3)])
    sizes = {c.name: shape.size if c.unit == "m" else 1.0 for c in equations.coordinates}
    around = {name: shape.position.get(name, 0.0) for name in sizes} | shape.position
    position = {name: value + spread * rng.uniform(-1, 1) * sizes.get(name, 1.0) for name, value in around.items()}
    velocity = {name: speed * rng.uniform(-1, 1) * size for name, size in sizes.items()}
    contacts = [contact.name for contact in equations.contacts]
    draw = rng.random()
    closed = rng.sample(contacts, rng.randint(0, len(contacts))) if draw < 0.15 else []
    opened = [name for name in contacts if name not in closed] if draw < 0.9 else []
    return {"position": position, "velocity": velocity, "closed": closed, "open": opened}
