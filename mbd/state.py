"""State and mode: what changes during a run, as values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Any
from weakref import ReferenceType, WeakKeyDictionary, ref

import numpy as np

from mbd.arrays import Vector
from mbd.dataclass import LateFields, dataclass
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.later import later
from mbd.notebook import table

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def _empty() -> Vector:
    return np.zeros(0)


def _nothing() -> Memory | None:
    return None


@dataclass(frozen=True)
class Mode:
    """Which contacts are closed, by name; the rest is open.

    Hashable, so that code made for a mode is found again.
    """

    closed: frozenset[str] = frozenset()

    def __contains__(self, name: str) -> bool:
        return name in self.closed


@dataclass(frozen=True, eq=False)
class Memory:
    """What a run knows beyond positions and velocities; opaque, for `simulate` alone.

    With it a run goes on as if it had not been cut: accelerations and auxiliary ones, multipliers, what predicts the
    next step, rows left out, sides of guards, the grid of instants, samples and states of controllers. It is used only
    where everything that it belongs to is the same to the bit, else the scheme is restarted; controllers go on also
    then, if the state is the same.

    Attributes
    ----------
    belongs : words that must be the same: scheme, step, options, names of rows, contacts, events, controllers
    digest : of the forces, rows and guards at the state: they must be the same too
    time : that of the state [s]; the clock among `reals` may differ from it by round-off
    parameters : values of all parameters that it was computed with
    reals, integers : the kernel's arrays one after the other
    scheme : memory of an integrator that steps in Python
    controllers : samples and states of controllers, and the time from which samples count
    pending : (kind, name) of events at this instant whose reset or controller failed, to be repeated
    place : (q, v, z) of the state; controllers go on from there whatever the scheme and its steps
    mode, anchors : those of the state, by which one that was changed by hand is told apart
    seal : hash of the rest; a memory that does not agree with it is damaged and never used
    """

    belongs: tuple[str, ...]
    digest: str
    time: float
    parameters: Vector
    reals: Vector
    integers: Vector
    scheme: Any = None
    controllers: Mapping[str, Any] = field(default_factory=dict)
    pending: tuple[tuple[str, str], ...] = ()
    place: Vector = field(default_factory=_empty)
    mode: Mode = Mode()
    anchors: Vector = field(default_factory=_empty)
    seal: str = ""


@dataclass(frozen=True, eq=False)
class State(LateFields):
    """Where a mechanism is and how it moves.

    Attributes
    ----------
    time : t [s]
    q : (n_q,) coordinates [m, rad]
    v : (n_v,) velocities [m/s, rad/s]
    z : (n_z,) first-order states
    mode : closed contacts
    armed : names of the open contacts that may close; None: decided from the gaps at the start
    anchors : values held since contacts closed (points of touchdown) [m], then the whole turns of planar cut joints
    names : coordinate names, in the order of q; velocity_names in the order of v
    moved : how far the assembly moved each named quantity from the value asked for [m, rad, m/s, rad/s]
    parameters : parameter values that differ from the model's
    memory : what a run needs beside this to go on exactly; None: it is started from the state alone. A state changed
        by ``dataclasses.replace`` may keep it: a memory of other values is never used
    begins : names of the modes and sampled laws that begin with this state: what they store at a start follows it where
        ``dataclasses.replace`` changes it, but for a later time, to which they last; others hold their `anchors`
    """

    time: float
    q: Vector
    v: Vector
    z: Vector = field(default_factory=_empty)
    mode: Mode = Mode()
    armed: frozenset[str] | None = None
    anchors: Vector = field(default_factory=_empty)
    names: tuple[str, ...] = ()
    velocity_names: tuple[str, ...] = ()
    moved: Mapping[str, float] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    memory: Memory | None = field(default_factory=_nothing, repr=False)
    begins: frozenset[str] = frozenset()

    def __getitem__(self, name: str) -> Any:
        """A coordinate ('left hip.angle') or a rate ('left hip.angle.rate', 'left hip.rate').

        'ball.orientation' is the quaternion (4,), 'ball.angular_velocity' a vector (3,). A state that knows its model
        (see `plot`) has all results of runs that do not follow from forces: 'left hip.flexion', 'left shank.end',
        angles of joints that are cut.
        """
        if not isinstance(name, str):
            raise UnknownNameError(f"a state is asked for one value by its name, such as 'hip.angle', not {name!r}")
        if name in self.names:
            return float(self.q[self.names.index(name)])
        if name in self.velocity_names:
            return float(self.v[self.velocity_names.index(name)])
        short = {
            rate.removesuffix(".rate").rpartition(".")[0] + ".rate": k for k, rate in enumerate(self.velocity_names)
        }
        if name in short:
            return float(self.v[short[name]])
        for ends in (".w", ".x", ".y", ".z"), (".x", ".y", ".z"):
            parts = [f"{name}{end}" for end in ends]
            for names, values in ((self.names, self.q), (self.velocity_names, self.v)):
                if all(part in names for part in parts):
                    return np.array([values[names.index(part)] for part in parts])
        found, beside = self._result(name)
        if found is not None:
            return found
        own = [*self.names, *self.velocity_names]
        wholes = {each[:-2] for each in own if each.endswith(".x") and f"{each[:-2]}.y" in own}
        wholes = {each for each in wholes if "." in each}
        raise UnknownNameError(
            nearest(name, [*own, *wholes], "coordinate or rate", "The state has", beside) + self._alone()
        )

    def _alone(self) -> str:
        """Why a state has coordinates and rates alone; nothing of one that knows its model."""
        known = _MODELS.get(self)
        if known is not None and known() is not None:
            return ""
        why = "it was made by hand, copied or read from a file" if known is None else (
            "the model was not kept; let the function that makes both return it too, as in 'return model, state'"
        )  # fmt: skip
        return f". Results such as places of bodies follow from the model, which this state does not know: {why}"

    def _result(self, name: str) -> tuple[Any, Sequence[str]]:
        """What a run would tell of it, and names of results; nothing of a state that knows no model."""
        run = self._instant() if isinstance(name, str) else None
        return (None, ()) if run is None else (later("State.result")(run, name), run.names)

    def _instant(self) -> Any:
        """A run of this one row; None of a state that knows no model, or whose model was changed since."""
        known = _MODELS.get(self)
        model = known() if known is not None else None
        if model is None:
            return None
        try:
            return later("State.instant")(model, self)
        except ModelError:
            return None

    def keys(self) -> list[str]:
        """All names that ``state[…]`` answers: coordinates, their rates and, of a state that knows its model, results.

        `names` are those of the coordinates alone, in the order of `q`.
        """
        run = self._instant()
        return list(
            dict.fromkeys([*self.names, *self.velocity_names, *(later("State.keys")(run) if run is not None else ())])
        )

    _ipython_key_completions_ = keys

    def __repr__(self) -> str:
        lines = [f"State at t = {self.time:g} s, closed: {', '.join(sorted(self.mode.closed)) or 'none'}"]
        for values, names in ((self.q, self.names), (self.v, self.velocity_names)):
            lines += [f"  {name:<28} {value: .10g}" for name, value in zip(names, values, strict=False)]
        if self.moved:
            far = max(self.moved.items(), key=lambda item: abs(item[1]))
            lines.append(f"  assembly moved {len(self.moved)} of these; farthest {far[0]!r} by {far[1]:.3g}")
        return "\n".join(lines)

    def plot(self, path: str | Path | None = None, model: Any = None, view: Any = None) -> Axes:
        """The mechanism at this state, drawn as on the page: bodies, joints, named points, the ground and its forces.

        The forces are those of the contacts that are closed at this state, of models without controllers; the largest
        has its size beside it.

        A spatial mechanism is seen from the side and a little from above, with gravity down the page, by parallel rays;
        bodies are the solids of their mass and inertia. Needs no display.

        Parameters
        ----------
        path : file to save the picture in, such as 'start.png' or 'start.svg'
        model : of which it is a state; a state that was assembled, projected or the end of a run knows it, one made or
            changed by hand, copied or read from a file does not
        view : of a spatial mechanism: 'front', 'side', 'top', or yaw about the vertical and pitch [rad]

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        ModelError
            without a model, for a state that is none of the model, for a mechanism without bodies, and for a view that
            is none.
        """
        known = _MODELS.get(self)
        of = model if model is not None else known() if known is not None else None
        if of is None:
            raise ModelError("this state does not know its model any more: give it, as in state.plot(model=model)")
        axes: Axes = later("State.plot")(of, self, path, view)
        return axes

    def _repr_html_(self) -> str:
        unit_of = later("State.unit")
        title = f"State at t = {self.time:g} s, closed: {', '.join(sorted(self.mode.closed)) or 'none'}"
        rows = [
            (name, f"{value:.10g}", unit_of(name))
            for values, names in ((self.q, self.names), (self.v, self.velocity_names))
            for name, value in zip(names, values, strict=False)
        ]
        return table(title, ("coordinate or rate", "value", "unit"), rows)


_MODELS: WeakKeyDictionary[State, ReferenceType[Any]] = WeakKeyDictionary()
"""The models of states, of which neither keeps the other."""


def of_model(state: State, model: Any) -> State:
    """The state, which knows its model from now on as long as the model is there."""
    _MODELS[state] = ref(model)
    return state


def malformed(state: State) -> list[str]:
    """What of a state is not even of the kind that it must be, a sentence each; names and sizes are not asked.

    Assembled states and those at the end of a run are well formed; one made or changed by hand may not be.
    """
    faults = [
        f"the {name} of the start must be an array of numbers (n,), not {_shown(value)}"
        for name, value in (("q", state.q), ("v", state.v), ("z", state.z), ("anchors", state.anchors))
        if not _is_vector(value)
    ]
    closed = state.mode.closed if isinstance(state.mode, Mode) else None
    if not are_names(closed):
        faults.append(f"the mode of the start must be a Mode(frozenset of names of contacts), not {_shown(state.mode)}")
    if state.armed is not None and not are_names(state.armed):
        faults.append(f"armed of the start must be None or a frozenset of names of contacts, not {_shown(state.armed)}")
    if not are_names(state.begins):
        faults.append(f"begins of the start must be a frozenset of names of modes and laws, not {_shown(state.begins)}")
    for name in ("names", "velocity_names"):
        value = getattr(state, name)
        if not isinstance(value, tuple) or not _are_words(value):
            faults.append(f"{name} of the start must be a tuple of names, not {_shown(value)}")
    if not isinstance(state.parameters, Mapping):
        faults.append(f"parameters of the start must map names to numbers, not {_shown(state.parameters)}")
    memory = vars(state).get("memory")
    if memory is not None and not isinstance(memory, Memory):
        faults.append(f"memory of the start must be that of a run, or None, not {_shown(memory)}")
    return faults


def _is_vector(value: Any) -> bool:
    """Whether a value is an array, list or tuple (n,) of real numbers."""
    if isinstance(value, np.ndarray):
        array = value
    elif isinstance(value, list | tuple):
        try:
            array = np.asarray(value)
        except ValueError:  # lists of different lengths
            return False
    else:
        return False
    return array.ndim == 1 and (array.dtype.kind in "fiu" or array.size == 0)


def are_names(value: Any) -> bool:
    """Whether a value is a set of names."""
    return isinstance(value, set | frozenset) and _are_words(value)


def _are_words(values: Iterable[Any]) -> bool:
    """Whether all values are strings."""
    return {str}.issuperset(map(type, values)) or all(isinstance(one, str) for one in values)


def _shown(value: Any) -> str:
    """The beginning of a value for a message."""
    try:
        return f"{value!r:.80}"
    except ValueError:  # an integer of thousands of digits inside
        return f"this {type(value).__name__}"
