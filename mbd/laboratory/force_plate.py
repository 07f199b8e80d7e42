"""What a force plate measured, acting on the foot that stands on it."""

import copy
from collections.abc import Sequence
from functools import cached_property, partial
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from scipy.interpolate import PchipInterpolator

from mbd.arrays import Matrix, Vector
from mbd.bodies.algebra import cross, difference
from mbd.bodies.base import Frame
from mbd.bodies.scope import Scope, Triple
from mbd.bodies.values import name_of, number, shown
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import Action, Force, Result, frame_of
from mbd.forces.quantities import Mention
from mbd.forces.samples import Samples
from mbd.laboratory.recording import MIN_PLATE_LOAD, PlateRecord, Recording
from mbd.tape.node import Scalar

PARTS = tuple(f"{kind}.{axis}" for kind in ("force", "moment") for axis in "xyz")
"""Components of what a plate does, about the origin of the ground."""


@dataclass(frozen=True, eq=False)
class ForcePlate(Force):
    """The force of a plate on a foot, with its center of pressure and free moment: power ``F·v + (M_O − p×F)·ω``.

    Force F and moment M_O about the origin of the ground are shape-preserving cubics through the samples, so that no
    center of pressure is needed where the plate is hardly loaded. Use it in `mbd.inverse_dynamics` (``plates=[…]``), or
    as a force of a model, ``model.apply(plate)``, whose runs then feel what was measured.

    Parameters
    ----------
    name : its name
    foot : a frame of the body that stands on it, such as foot.heel
    recording : see `mbd.read`, or a `PlateRecord`
    plate : number of the plate in it, from 1, or its name
    during : (first, last) times in which this foot stands on it, or several such spans [s]; all by default
    threshold : vertical force below which the plate counts as unloaded [N]

    Raises
    ------
    ModelError
        for what is no frame, no recording, and a plate that the recording lacks.
    """

    name: str
    foot: Frame
    recording: Any
    plate: Any = 1
    during: Any = None
    threshold: float = MIN_PLATE_LOAD

    kind = "applied"
    is_external = True

    def __post_init__(self) -> None:
        name_of(self.name, "ForcePlate")
        frame_of(self.foot, f"foot of ForcePlate '{self.name}'")
        put = object.__setattr__
        put(self, "threshold", number(self.threshold, f"threshold of '{self.name}'"))
        put(self, "during", _spans(self.during, f"during of '{self.name}'"))
        self.record  # noqa: B018  which names what is wrong

    @cached_property
    def record(self) -> PlateRecord:
        """What the plate measured."""
        source = self.recording
        if isinstance(source, PlateRecord):
            return source
        if not isinstance(source, Recording):
            raise ModelError(
                f"ForcePlate '{self.name}' needs a recording, as mbd.read gives it; got {shown(source)[:80]}"
            )
        names = [each.name for each in source.plates]
        if isinstance(self.plate, str) and self.plate in names:
            return source.plates[names.index(self.plate)]
        if isinstance(self.plate, int) and not isinstance(self.plate, bool) and 1 <= self.plate <= len(names):
            return source.plates[self.plate - 1]
        known = ", ".join(map(repr, names)) or "none"
        raise ModelError(f"ForcePlate '{self.name}': plate={self.plate!r}; the recording has {known}, counted from 1")

    @cached_property
    def wrench(self) -> Matrix:
        """F and M_O at the samples (A, 6), zero where the foot does not stand on it."""
        record = self.record
        acts = record.force[:, 1] > self.threshold
        if self.during is not None:
            inside = np.zeros(len(record.time), dtype=bool)
            for first, last in self.during:
                inside |= (record.time >= first) & (record.time <= last)
            acts &= inside
        return np.where(acts[:, np.newaxis], np.column_stack([record.force, record.moment]), 0.0)

    def at(self, time: Vector) -> Matrix:
        """F and M_O (R, 6) at times within those of the plate; a `ModelError` for others."""
        own = self.record.time
        slack = (own[-1] - own[0]) / max(len(own) - 1, 1)
        if len(time) and (time[0] < own[0] - slack or time[-1] > own[-1] + slack):
            raise ModelError(
                f"ForcePlate '{self.name}' measured from {own[0]:g} to {own[-1]:g} s, the motion is from {time[0]:g} "
                f"to {time[-1]:g} s; cut it by recording.between(…)"
            )
        if len(own) == 1:
            return np.broadcast_to(self.wrench[0], (len(time), 6)).copy()
        return np.asarray(PchipInterpolator(own, self.wrench)(np.clip(time, own[0], own[-1])))

    def mentions(self) -> list[Mention]:
        """Its foot."""
        return [self.foot]

    def parameters(self) -> dict[str, float]:
        """None."""
        return {}

    def laws(self) -> tuple[str, ...]:
        """What it does."""
        return (f"{self.name}.force",)

    def _components(self, scope: Scope) -> list[Scalar]:
        record = self.record
        return [
            Samples(record.time, column).signal(scope, f"{self.name}.{part}", "monotone") if column.any() else 0.0
            for part, column in zip(PARTS, self.wrench.T, strict=True)
        ]

    def act(self, scope: Scope) -> Action:
        """Force on velocity, moment about the foot's point on angular velocity."""
        return _action(scope, self.foot, self._components(scope))

    def results(self) -> dict[str, Result]:
        """'force'."""
        return {"force": Result(partial(self._force), is_vector=True)}

    def _force(self, scope: Scope) -> Sequence[Scalar]:
        return self._components(scope)[:3]


@dataclass(frozen=True)
class Load(Force):
    """The same with run-time parameters 'plate 1.force.x', … in place of samples, for frames that are evaluated one by
    one."""

    name: str
    foot: Frame

    kind = "applied"

    def mentions(self) -> list[Mention]:
        """Its foot."""
        return [self.foot]

    def parameters(self) -> dict[str, float]:
        """Components, whose values here mean nothing."""
        return {f"{self.name}.{part}": 2.0 for part in PARTS}

    def act(self, scope: Scope) -> Action:
        """As a `ForcePlate`."""
        return _action(scope, self.foot, [scope.parameter(self.name, part, 2.0) for part in PARTS])

    def results(self) -> dict[str, Result]:
        """'force'."""
        return {"force": Result(partial(self._force), is_vector=True)}

    def _force(self, scope: Scope) -> Sequence[Scalar]:
        return [scope.parameter(self.name, part, 2.0) for part in PARTS[:3]]


def _action(scope: Scope, foot: Frame, parts: Sequence[Scalar]) -> Action:
    motion = scope.frame(foot)
    force: Triple = (parts[0], parts[1], parts[2])
    about: Triple = (parts[3], parts[4], parts[5])
    moment = difference(about, cross(motion.position, force))
    pairs = [*zip(motion.velocity, force, strict=True), *zip(motion.angular_velocity, moment, strict=True)]
    return Action(pairs=tuple(pairs))


def _spans(during: Any, what: str) -> tuple[tuple[float, float], ...] | None:
    if during is None:
        return None
    try:
        table = np.asarray(during, dtype=float)
    except (TypeError, ValueError, OverflowError):
        table = np.zeros(0)
    if table.shape == (2,):
        table = table[np.newaxis]
    if table.ndim != 2 or table.shape[1] != 2 or not np.all(table[:, 0] < table[:, 1]):
        raise ModelError(f"{what} must be (first, last) times [s] or several of them, got {shown(during)[:80]}")
    return tuple((float(a), float(b)) for a, b in table)


def all_plates(plates: Any) -> tuple[ForcePlate, ...]:
    """Plates given as one or several, checked."""
    several = (plates,) if isinstance(plates, ForcePlate) else plates
    if isinstance(several, list | tuple) and all(isinstance(plate, ForcePlate) for plate in several):
        return tuple(several)
    raise ModelError(f"plates must be several mbd.ForcePlate('plate', foot.heel, recording), got {shown(plates)[:80]}")


# models that plates push on -----------------------------------------------------------------------------------------
_LOADED: WeakKeyDictionary[Any, dict[Any, Any]] = WeakKeyDictionary()


def loaded_model(model: Any, plates: Sequence[ForcePlate]) -> Any:
    """The model with a load in the place of each plate, the same one until it changes, so that it is derived once.

    Raises
    ------
    ModelError
        for a name that the model has.
    """
    if not plates:
        return model
    if not hasattr(model, "forces"):
        raise ModelError("plates push on bodies, which a Lagrangian does not have")
    names = [force.name for force in model.forces] + [plate.name for plate in plates]
    twice = [plate.name for plate in plates if names.count(plate.name) > 1]
    if twice:
        raise ModelError(f"plates: there are two forces called {twice[0]!r}; give each plate a name of its own")
    words = (*model.joints, *model.forces, *model.constraints, *model.controllers, *model.observations)
    loads = tuple((plate.name, id(plate.foot.body), plate.foot.full_name) for plate in plates)
    key = (loads, tuple(map(id, words)), model.gravity, model.cut, model.tunable)
    known = _LOADED.setdefault(model, {})
    if key not in known:
        loaded = copy.copy(model)
        loaded.forces = [*model.forces, *(Load(plate.name, plate.foot) for plate in plates)]
        known[key] = loaded
    return known[key]


def wrenches(plates: Sequence[ForcePlate], time: Vector) -> dict[str, Vector]:
    """Values of the parameters of the loads at each frame (R,), by name."""
    found: dict[str, Vector] = {}
    for plate in plates:
        found |= {f"{plate.name}.{part}": column for part, column in zip(PARTS, plate.at(time).T, strict=True)}
    return found
