"""Forces of muscles from motion: static optimization, frame by frame."""

import copy
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.bodies.scope import Scope
from mbd.bodies.values import is_number, named_number_faults, number, shown
from mbd.compile.mechanisms import mechanism_of
from mbd.dataclass import dataclass, forwarded
from mbd.equal import ROUND_OFF_RTOL
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.forces.base import Action, Force
from mbd.forces.muscles import Muscle
from mbd.forces.samples import Samples
from mbd.laboratory.balance_result import InverseDynamics
from mbd.laboratory.force_plate import ForcePlate
from mbd.laboratory.inverse_dynamics import inverse_dynamics
from mbd.laboratory.least_activation import least_activation
from mbd.laboratory.motion import Motion
from mbd.laboratory.motion_record import record_of
from mbd.results.columns import ModelColumns
from mbd.results.tables import library
from mbd.tape.derivatives import gradient


class MuscleForces:
    """Activations and forces of muscles, asked for by name.

    ``found["left soleus.activation"]`` (R,), ``'left soleus.force'`` [N] of the tendon with its parts
    ``'….active_strength'`` (at a = 1) and ``'….passive_force'``, ``'left soleus.length'`` of the path and
    ``'left soleus.moment_arm.left ankle.angle'`` [m], −∂l/∂q; ``'left ankle.angle.reserve'`` [N m] is what the muscles
    together cannot give. All other names are those of `InverseDynamics` but joint reactions, of which there are two:

    - ``found.moments["left knee.reaction_force"]`` is what the joint transmits where a pure moment acts in the place of
      muscles: the *resultant* joint force of inverse dynamics.
    - ``found.with_muscles["left knee.reaction_force"]`` is what the joint transmits where muscles pull across it, the
      *joint contact force*: often several times as large.

    Attributes
    ----------
    moments : the `InverseDynamics` that the muscles balance
    with_muscles : the `InverseDynamics` of the same motion while the muscles pull, found when it is first asked for;
        its moments are the reserves
    muscles : their names
    notes : what a reader must know, a sentence each
    """

    def __init__(
        self,
        moments: InverseDynamics,
        muscles: tuple[str, ...],
        own: dict[str, Vector],
        notes: tuple[str, ...],
        pulled: Callable[[], InverseDynamics],
    ) -> None:
        self.moments, self.muscles, self.notes = moments, muscles, notes
        self._own, self._pulled = own, pulled

    @cached_property
    def with_muscles(self) -> InverseDynamics:
        """Inverse dynamics of the motion while the muscles pull, whose joint reactions are contact forces."""
        return self._pulled()

    @property
    def time(self) -> Vector:
        """Times of the frames (R,) [s]."""
        return self.moments.time

    def __getitem__(self, name: str) -> Any:
        """A named quantity at every frame."""
        if isinstance(name, str) and name in self._own:
            return self._own[name]
        if isinstance(name, str) and ".reaction_" in name and name in self.moments:
            raise UnknownNameError(
                f"{name!r} is there twice: found.with_muscles[{name!r}] is the contact force of the joint, across "
                f"which muscles pull, found.moments[{name!r}] the resultant of inverse dynamics without muscles"
            )
        if name not in self.moments:
            raise UnknownNameError(nearest(str(name), (*self._own, *self.moments.names), "result", "There are"))
        return self.moments[name]

    def __contains__(self, name: object) -> bool:
        return name in self._own or (name in self.moments and ".reaction_" not in str(name))

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    @property
    def names(self) -> tuple[str, ...]:
        """Every named scalar, those of muscles first."""
        return (*self._own, *(name for name in self.moments.names if ".reaction_" not in name))

    def to_dataframe(self, names: Sequence[str] | None = None) -> Any:
        """A pandas table with `time` as index; by default of activations, forces and reserves."""
        pandas = library("pandas", "data", "MuscleForces.to_dataframe()")
        listed = [n for n in self._own if n.endswith((".activation", ".force", ".reserve"))] if names is None else names
        return pandas.DataFrame({name: self[name] for name in listed}, index=pandas.Index(self.time, name="time"))

    def __repr__(self) -> str:
        strongest = max(self.muscles, key=lambda name: float(self._own[f"{name}.force"].max()))
        busiest = max(self.muscles, key=lambda name: float(self._own[f"{name}.activation"].max()))
        lines = [
            f"MuscleForces: {len(self.muscles)} muscles, {len(self.time)} frames",
            f"  largest force: {strongest!r} {self._own[f'{strongest}.force'].max():.3g} N",
            f"  largest activation: {busiest!r} {self._own[f'{busiest}.activation'].max():.3g}",
        ]
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])


def muscle_forces(
    model: Any,
    motion: Any,
    muscles: Mapping[str, Muscle] | Sequence[Muscle] | None = None,
    *,
    joints: Sequence[str] | None = None,
    plates: Sequence[ForcePlate] = (),
    parameters: Mapping[str, float] | None = None,
    reserve: float = 1.0,
) -> MuscleForces:
    """Activations of least ``Σ a³ + Σ (ρ/ρ₀)²`` that give the moments of a motion, frame by frame.

    1. `mbd.inverse_dynamics` of the model without its muscles gives the moments τ.
    2. Tendons count as rigid and activations as free from frame to frame, so that the force of a muscle is linear in
       its activation, ``F = a F_max f_L f_V cos α + F_P``; its moment arm is −∂l/∂q.
    3. ``τ_j = Σ r_j F + ρ_j`` with 0 ≤ a ≤ 1 about every driven coordinate that a muscle crosses. The reserve ρ is
       what the muscles cannot give. An interior-point method solves all frames at once (`least_activation`).

    R. D. Crowninshield and R. A. Brand, J. Biomech. 14 (1981) 793.

    Parameters
    ----------
    model, motion, joints, plates, parameters : as for `mbd.inverse_dynamics`
    muscles : those that act, by default those of the model: ``mbd.read_model("leg.osim").muscles``
    reserve : ρ₀, moment or force that costs as much as a full activation [N m, N]

    Raises
    ------
    ModelError
        for a model without muscles, muscles that act about no driven coordinate, and as `mbd.inverse_dynamics`.
    SimulationError
        where the solver ends without a solution, with the time.
    """
    acting = _muscles(model, muscles)
    if not is_number(reserve) or number(reserve, "reserve") <= 0.0:
        raise ModelError(f"reserve is the moment that costs as much as a full activation, > 0 N m; got {reserve!r}")
    if faults := named_number_faults(parameters, "parameters"):
        raise ModelError(faults)
    own = [force.name for force in model.forces if isinstance(force, Muscle)]
    bare = model.without(*own) if own else model
    of_muscles = {name for muscle in acting for name in muscle.parameters()}
    others = {name: value for name, value in (parameters or {}).items() if name not in of_muscles}
    moments = inverse_dynamics(bare, motion, joints, plates=plates, parameters=others)
    crossed = _crossed(bare, acting, moments, parameters or {})
    arms, strength, passive, length = crossed.arms, crossed.strength, crossed.passive, crossed.length
    driven = moments.driven
    together = np.abs(arms * strength[:, np.newaxis]).sum(axis=2).max(axis=0)
    about = np.flatnonzero(driven & (together > ROUND_OFF_RTOL * together.max(initial=0.0)))
    if not len(about):
        raise ModelError("the muscles act about no driven coordinate of the model; check their paths, or joints=")
    wanted = moments.effort[:, about] - np.einsum("kjm,km->kj", arms[:, about], passive)
    activation, reserves = least_activation(
        arms[:, about] * strength[:, np.newaxis], wanted, float(reserve), moments.time
    )

    names = [name.removesuffix(".rate") for name in crossed.velocities]
    found: dict[str, Vector] = {}
    for m, muscle in enumerate(acting):
        found[f"{muscle.name}.activation"] = activation[:, m]
        found[f"{muscle.name}.force"] = activation[:, m] * strength[:, m] + passive[:, m]
        found[f"{muscle.name}.length"] = length[:, m]
        found[f"{muscle.name}.active_strength"] = strength[:, m]
        found[f"{muscle.name}.passive_force"] = passive[:, m]
        for j in np.flatnonzero(np.abs(arms[:, :, m]).max(axis=0) > 0.0):
            found[f"{muscle.name}.moment_arm.{names[j]}"] = arms[:, j, m]
    for k, j in enumerate(about):
        found[f"{names[j]}.reserve"] = reserves[:, k]

    def pulled() -> InverseDynamics:
        loaded = copy.copy(bare)
        loaded.forces = [*bare.forces, *_rigid(acting, moments.time, activation)]
        known = {name for muscle in loaded.forces for name in muscle.parameters()} | set(others)
        values = {name: value for name, value in (parameters or {}).items() if name in known}
        return inverse_dynamics(loaded, moments.run, joints, plates=plates, parameters=values)

    remarks = _notes(moments, names, about, activation, reserves)
    return MuscleForces(moments, tuple(muscle.name for muscle in acting), found, remarks, pulled)


def _muscles(model: Any, given: Any) -> list[Muscle]:
    if not hasattr(model, "forces"):
        raise ModelError(f"model must be a Model, on whose bodies muscles pull, not {shown(model)}")
    if given is None:
        found = [force for force in model.forces if isinstance(force, Muscle)]
        if not found:
            raise ModelError(f"'{model.name}' has no mbd.Muscle; apply some, or give muscles=[…]")
        return found
    listed = list(given.values()) if isinstance(given, Mapping) else [given] if isinstance(given, Muscle) else given
    if not isinstance(listed, list | tuple) or not listed or not all(isinstance(each, Muscle) for each in listed):
        raise ModelError(f"muscles must be several mbd.Muscle, got {shown(given)[:80]}")
    return list(listed)


def _rigid(muscles: list[Muscle], time: Vector | None = None, activation: Matrix | None = None) -> list[Muscle]:
    """Muscles whose tendons do not give, with these activations (R, m), or fully active."""
    without: dict[str, Any] = {"tendon": "rigid", "activation_time": 0.0, "deactivation_time": 0.0, "arguments": ("t",)}
    excitations: list[Any] = [1.0] * len(muscles)
    if time is not None and activation is not None:
        several = len(time) > 1
        excitations = [Samples(time, column, "linear") if several else float(column[0]) for column in activation.T]
    return [replace(each, excitation=e, **without) for each, e in zip(muscles, excitations, strict=True)]


@dataclass(frozen=True)
class _Idle(Force):
    """A muscle that does not pull: its results, and none of its force in the equations of motion."""

    name: str
    muscle: Muscle

    kind, mentions, parameters = map(forwarded, ("muscle.kind", "muscle.mentions", "muscle.parameters"))
    domains, results = map(forwarded, ("muscle.domains", "muscle.results"))

    def act(self, scope: Scope) -> Action:
        """Nothing; what the muscle would do declares its parameters."""
        self.muscle.act(scope)
        return Action()


@dataclass(frozen=True, eq=False)
class _Crossed:
    """What muscles can do: arms (R, n_v, m) [m], strength and passive force (R, m) [N], length (R, m) [m]."""

    arms: NDArray[np.float64]
    strength: Matrix
    passive: Matrix
    length: Matrix
    velocities: tuple[str, ...]


def _crossed(bare: Any, muscles: list[Muscle], moments: InverseDynamics, changed: Mapping[str, float]) -> _Crossed:
    """Paths and curves at the frames, as results of muscles whose tendons are rigid and which do not pull."""
    rigid = _rigid(muscles)
    loaded = copy.copy(bare)
    loaded.forces = [*bare.forces, *(_Idle(muscle.name, muscle) for muscle in rigid)]
    own = {name for muscle in rigid for name in muscle.parameters()}
    known = {name for muscle in muscles for name in muscle.parameters()}
    values = {k: v for k, v in changed.items() if k not in known or k in own}
    mechanism = mechanism_of(loaded, "auto", values)
    equations = mechanism.equations
    state = moments.run.record
    motion = Motion(state.time, state.q, state.v, state.a)
    parameters = mechanism.parameters_of(loaded, values)
    columns = ModelColumns(record_of(mechanism, motion, parameters), equations)
    with equations.tape.lock:
        x = [equations.tape.input("x", k) for k in range(equations.n_v)]
        fields = ("length", "active_strength", "passive_force")
        nodes = [[columns.node(f"{muscle.name}.{field}") for muscle in rigid] for field in fields]
        slopes = [[equations.tape.lift(slope) for slope in gradient(node, x)] for node in nodes[0]]
    flat = [node for group in (*nodes, *slopes) for node in group]
    table = np.column_stack(columns.evaluate(flat, columns.rows))
    m, n = len(rigid), equations.n_v
    arms = -table[:, 3 * m :].reshape(len(table), m, n).transpose(0, 2, 1)
    found = [table[:, k * m : (k + 1) * m] for k in range(3)]
    for k, muscle in enumerate(rigid):
        if not all(np.all(np.isfinite(each[..., k])) for each in (*found, arms)):
            raise ModelError(f"the path or the fibers of '{muscle.name}' have no length in some frames; see its path")
    return _Crossed(arms, found[1], found[2], found[0], tuple(equations.velocity_names))


def _notes(
    moments: InverseDynamics, names: list[str], about: NDArray[np.intp], activation: Matrix, reserves: Matrix
) -> tuple[str, ...]:
    found = list(moments.notes)
    largest = np.abs(reserves).max(axis=0)
    worst = int(np.argmax(largest))
    found.append(f"largest reserve: {largest[worst]:.3g} about {names[about[worst]]!r}")
    full = int(np.sum(activation.max(axis=1) > 1.0 - 1e-6))
    if full:
        found.append(f"a muscle is fully active in {full} of {len(activation)} frames")
    return tuple(found)
