"""Fuzzed scenes: a mechanism, values of its parameters, a start, a scheme and its steps, all made from one number."""

import math
import random
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import mbd
from tests.fuzz.structures import DRIVEN, SPACE, Structure, structure

STRUCTURES = 160
"""How many mechanisms there are if nothing else is said; scenes with numbers equal modulo this share one."""

SCHEMES: tuple[Any, ...] = (
    mbd.HHT(0.05), mbd.HHT(0.3), mbd.GeneralizedAlpha(0.9), mbd.GeneralizedAlpha(0.0), mbd.GeneralizedAlpha(0.5),
    mbd.Newmark(), mbd.Newmark(0.3025, 0.6), mbd.HHT(0.05, formulation="index3"), mbd.HHT(0.05, start="consistent"),
    mbd.GeneralizedAlpha(0.7, formulation="index3"), mbd.RadauIIA(), mbd.RadauIIA(), mbd.RungeKutta853(),
    mbd.RungeKutta853(),
)  # fmt: skip
LONGEST = 0.015
"""Step of driven scenes at most [s]: a drive moves any way within a step, which laws along rows do not see."""
VARIED = (
    ".mass",
    ".inertia",
    ".stiffness",
    ".damping",
    ".coefficient",
    ".torque",
    ".mu",
    ".length",
    ".center",
    ".x",
    ".y",
)
"""Endings of parameters that scenes change."""


@dataclass(frozen=True)
class Scene:
    """What to run.

    number : what it was made from; form : its mechanism
    cut : which joints are cut; start : arguments of `mbd.assemble`
    options : arguments of `mbd.simulate` besides model and start
    check : what is compared beside the laws: '', 'restart', 'file', 'cut', 'twin', 'between', 'step there', 'one ulp',
        'tolerance', 'schemes', 'form'
    structures : how many mechanisms scenes were drawn from
    """

    number: int
    form: Structure
    cut: Any
    start: Mapping[str, Any]
    options: Mapping[str, Any]
    check: str
    structures: int = STRUCTURES

    @property
    def model(self) -> mbd.Model:
        """The mechanism with the joints that are cut."""
        return self.form.with_cut(self.cut)

    @property
    def parameters(self) -> Mapping[str, float]:
        """Parameters that differ from those of the model."""
        found: Mapping[str, float] = self.start["parameters"]
        return found

    def __str__(self) -> str:
        options = ", ".join(f"{name}={value!r}" for name, value in self.options.items())
        return f"{self.number}: {self.form.kind} {self.form.number}, cut={self.cut!r}, {options}, check {self.check!r}"


def scene(number: int, structures: int = STRUCTURES) -> Scene:
    """The scene of a number.

    Raises
    ------
    ModelError
        where the library refuses the words of its mechanism.
    """
    form = structure(number % structures + (DRIVEN if number >= DRIVEN else SPACE if number >= SPACE else 0))
    rng = random.Random(f"scene {number}")
    cut: Any = rng.choices(["auto", *form.cuts], [3, *(1 for _ in form.cuts)])[0]
    scheme = rng.choice(SCHEMES)
    options: dict[str, Any] = {"integrator": scheme}
    dt = 10.0 ** (rng.uniform(-3.3, -1.8) if rng.random() < 0.8 else rng.uniform(-6.0, -1.0))
    steps = 10.0 ** rng.uniform(1.0, 2.3)
    explicit = isinstance(scheme, mbd.RungeKutta853 | mbd.RadauIIA)
    if rng.random() < 0.2 and getattr(scheme, "formulation", "ggl") != "index3" and scheme.order() > 1:
        options |= {"tol": 10.0 ** rng.uniform(-8 if explicit else -4.5, -2), "until": rng.uniform(0.1, 0.5)}
    else:
        options |= {"dt": dt, "until": dt * steps}
    contacts = bool(form.model.contacts)
    if contacts:
        options["contact"] = rng.choice(
            ["auto", "events", "events", "nonsmooth"] if "dt" in options else ["auto", "events"]
        )
        options["impact"] = rng.choice(["newton", "newton", "poisson", "sequential"])
    check = rng.choice(["", "", "restart", "file", "cut", "between", "between", "step there", "one ulp"])
    if "tol" in options and check in ("restart", "file", "step there"):
        check = "tolerance"
    if rng.random() < 0.02:
        check = "twin"
    if number >= DRIVEN:
        return _driven(rng, Scene(number, form, cut, {}, options, check, structures))
    return Scene(number, form, cut, _start(rng, form), options, check, structures)


def _driven(rng: random.Random, made: Scene) -> Scene:
    """A scene of a driven mechanism: at rest or with the rates that its drives have, long enough to dwell.

    More schemes and comparisons than others have.
    """
    form, options = made.form, dict(made.options)
    scheme = rng.choice([*SCHEMES, mbd.RungeKutta4(), mbd.HHT(0.05), mbd.HHT(0.05), mbd.RadauIIA()])
    explicit = not hasattr(scheme, "coefficients")
    options["integrator"] = scheme
    until = rng.uniform(0.1, 1.0)
    index3 = getattr(scheme, "formulation", "ggl") == "index3"
    if rng.random() < 0.4 and not index3 and scheme.order() > 1:
        options.pop("dt", None)
        options |= {"tol": 10.0 ** rng.uniform(-7 if explicit else -4, -2), "until": until}
    else:
        options.pop("tol", None)
        steps = 10.0 ** (rng.uniform(0.7, 1.7) if explicit else rng.uniform(1.3, 2.7))
        options |= {"dt": min(until / steps, LONGEST), "until": until}
    if options.get("contact") == "nonsmooth" and ("tol" in options or form.kind == "stribeck"):
        options["contact"] = "events"
    check = rng.choice(["", "cut", "between", "schemes", "schemes", "step there", "restart", "one ulp"])
    if "tol" in options:
        check = rng.choice(["tolerance", "tolerance", "cut", "between"])
    free = [name for name in form.position if name not in form.held and ".orientation" not in name]
    velocity = {}
    if free and rng.random() < 0.5:
        fast = rng.choice([1.0, 0.1, 3.0])
        velocity = {name: fast * rng.choice([rng.uniform(-1, 1), 1.0, 0.0]) for name in free}
    tied = form.loops and bool(form.held)
    if form.kind == "driven linkage":
        tied, velocity = False, {}
    values = {} if form.loops else _parameters(rng, form)
    start = {"position": form.position, "velocity": velocity, "parameters": values, "project": not tied}
    return replace(made, start=start, options=options, check=check)


def _start(rng: random.Random, form: Structure) -> dict[str, Any]:
    """The pose of the mechanism or one nearby, any speed, other parameters.

    Where rows tie coordinates together, mostly the pose itself and one rate; sometimes more than they allow, which is
    projected or refused.
    """
    tied = form.loops and rng.random() < 0.85
    spread = 0.0 if tied else rng.choice([0.0, 0.0, 0.02, 0.02 if form.model.contacts else 0.3])
    speed = rng.choice([0.0, 1.0, 10.0 ** rng.uniform(-3, 1)])
    position = {name: _moved(rng, value, spread) for name, value in form.position.items()}
    free = [name for name in form.position if not form.held or name not in form.held]
    moving = rng.sample(free, 1) if tied and free else free
    if form.number >= SPACE and speed:
        return _in_space(rng, form, position, speed * (1.0 if tied else 2.0))
    velocity = {name: speed * rng.uniform(-1, 1) for name in moving} if speed else {}
    values = _parameters(rng, form)
    return {"position": position, "velocity": velocity, "parameters": values, "project": not tied}


def _moved(rng: random.Random, value: Any, spread: float) -> Any:
    """A coordinate near a value; of a quaternion one near it."""
    if not isinstance(value, tuple):
        return value + spread * rng.uniform(-1, 1)
    parts = [part + 0.5 * spread * rng.uniform(-1, 1) for part in value]
    size = math.sqrt(sum(part * part for part in parts))
    return tuple(part / size for part in parts)


def _in_space(rng: random.Random, form: Structure, position: Mapping[str, Any], speed: float) -> dict[str, Any]:
    """Rates of every joint of the pose; those that rows do not allow are projected."""
    velocity: dict[str, Any] = {}
    for joint in form.model.joints:
        for label in joint.freedoms:
            if label.name.startswith("angular_velocity."):
                name = f"{joint.name}.angular_velocity"
                velocity.setdefault(name, tuple(speed * rng.uniform(-1, 1) for _ in range(3)))
            else:
                velocity[f"{joint.name}.{label.name}"] = speed * rng.uniform(-1, 1)
    return {"position": position, "velocity": velocity, "parameters": _parameters(rng, form), "project": True}


def _parameters(rng: random.Random, form: Structure) -> dict[str, float]:
    """Some masses, stiffnesses, losses; lengths only where no loop depends on them."""
    if rng.random() < 0.4:
        return {}
    known = form.model.parameters
    ends = VARIED if not form.loops and not form.model.contacts else VARIED[:7]
    free = [name for name, value in known.items() if name.endswith(ends) and value not in (0.0, 1.0, -1.0)]
    picked = rng.sample(free, min(len(free), rng.randint(1, 4)))
    return {name: known[name] * 10.0 ** rng.uniform(-0.5, 0.5) for name in picked}
