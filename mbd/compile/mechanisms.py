"""Derived and compiled mechanisms, kept as long as the model that they were made from is unchanged.

The last few are kept by their words, too: a model that says the same as another one has the same equations.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Collection, Hashable, Mapping
from operator import is_
from typing import Any, Generic, TypeVar, overload
from weakref import WeakKeyDictionary

import numpy as np

from mbd.compile import remembered
from mbd.compile.forking import free_in_child
from mbd.compile.mechanism import Mechanism
from mbd.compile.same_words import Words, as_it_is, changing, read_words
from mbd.constraints.base import Constraint
from mbd.equations.derivation import FrontDoor, derive
from mbd.errors import ModelError
from mbd.forces.base import Force
from mbd.free_memory import no_collection
from mbd.joints.base import Joint
from mbd.notes import PROCESS, doubt
from mbd.topology.check import parameter_check
from mbd.topology.description import Description

_KNOWN: WeakKeyDictionary[Any, dict[tuple[str, frozenset[str]], _Kept[Mechanism]]] = WeakKeyDictionary()
_TUNABLE: WeakKeyDictionary[Any, dict[frozenset[str], _Kept[Any]]] = WeakKeyDictionary()
_BY_WORDS: OrderedDict[Hashable, Mechanism] = OrderedDict()
"""The mechanisms that were asked for last, by what their models say."""
MAX_KEPT_BY_WORDS = 4
"""How many of them: each may hold arrays of 32 MB for the runs that follow."""
_LOCK = threading.Lock()
Made = TypeVar("Made")
free_in_child(_LOCK)


def _description(model: Any) -> Any:
    """What the equations depend on, by identity of the words."""
    kinds = ("joints", "forces", "constraints", "controllers", "observations", "nonholonomic")
    words = [getattr(model, kind, ()) for kind in kinds]
    groups = tuple(tuple(group.values() if isinstance(group, Mapping) else group) for group in words)
    own = () if isinstance(model, Description) else tuple(getattr(model, "parameters", {}).items())
    return groups, *(getattr(model, key, None) for key in ("gravity", "cut", "tunable")), own


def _same(old: Any, new: Any) -> bool:
    groups = zip(old[0], new[0], strict=True)
    alike = all(len(a) == len(b) and all(map(is_, a, b)) for a, b in groups)
    return alike and old[1:] == new[1:]


class _Kept(Generic[Made]):
    """What was made of a model, as long as its words and the named points of its bodies are the same.

    So must be what functions refer to: a global value that was set again, or a list whose numbers have changed.

    Attributes
    ----------
    allowed : the values of parameters that were asked for last, which its words allow
    """

    def __init__(self, model: Any, described: Any, made: Made, are_fixed: bool = False) -> None:
        self.described, self.made = described, made
        self.allowed: Mapping[str, float] = {}
        self._bodies = bodies_of(model)
        self._points = self._present()
        whole = isinstance(model, Description)
        words = [model.joints, model.forces, model.constraints, model.observations] if whole else [model]
        self._changing = [] if are_fixed else changing(words)
        self._were = as_it_is(self._changing) if self._changing else None

    def _present(self) -> list[Any]:
        return [point for body in self._bodies for point in body.points.values()]

    def serves(self, described: Any) -> bool:
        """Whether it is still what the model would make."""
        if not _same(self.described, described):
            return False
        points = self._present()
        if len(points) != len(self._points) or not all(map(is_, points, self._points)):
            return False
        return self._were is None or as_it_is(self._changing)[0] == self._were[0]

    def allows(self, changed: Mapping[str, float]) -> bool:
        """Whether these are the values that were allowed last; True is equal to 1, but no number."""
        return self.allowed == changed if set(map(type, changed.values())) <= {float, np.float64, int} else False


def bodies_of(model: Any) -> list[Any]:
    """The bodies whose named points are results, which follow from the words."""
    if not isinstance(model, Description):
        return []
    return list(({id(frame.body): frame.body for frame in model.points()} | {id(model.ground): model.ground}).values())


def require_model(model: Any) -> None:
    """Raise a `ModelError` for what is no model."""
    if not isinstance(model, Description | FrontDoor):
        person = "; put a person into one: model.connect(*person.joints)" if hasattr(model, "joints") else ""
        raise ModelError(f"model: a Model or a Lagrangian is expected, not {model!r}{person}")


def mechanism_of(
    model: Any, backend: str = "auto", changed: Mapping[str, float] | None = None, inputs: Collection[str] = ()
) -> Mechanism:
    """The mechanism of a model; derived again only if the model has changed since.

    Parameters
    ----------
    backend : 'auto', 'llvm' (machine code) or 'python' (plain Python)
    changed : parameter values that are wanted; an exact 0 or ±1 of the model among them, which is folded into the
        equations, is made a run-time input (one more derivation, noted in `Mechanism.notes`)
    inputs : names that are to be run-time inputs whatever their values, those of increments of laws among them

    Raises
    ------
    ModelError
        for values that the words of the model do not allow, as if it had been described with them.
    """
    require_model(model)
    if not isinstance(backend, str):
        raise ModelError(f"backend must be 'auto', 'llvm' or 'python', not {backend!r}")
    kept = _kept(model, backend, frozenset(), derived=False)
    if changed and (kept is None or not kept.allows(changed)):
        checked = parameter_check(model) if isinstance(model, Description) else model.parameter_check()
        if faults := checked.faults(changed):
            raise ModelError(faults)
    kept = _kept(model, backend, frozenset()) if kept is None else kept
    kept.allowed, mechanism = dict(changed or {}), kept.made
    controllers = getattr(model, "controllers", ())
    if not changed and not inputs and not controllers:
        return mechanism
    present = mechanism.parameter_places
    written = {name for controller in controllers for name in controller.writes if name not in present}
    others = {name: value for name, value in (changed or {}).items() if name not in present}
    structural = {name for name in inputs if name not in present}
    if written or others:
        values = getattr(model, "parameters", {})
        structural |= {name for name in written if name in values}
        structural |= {name for name, value in others.items() if name in values and values[name] != value}
    return _kept(model, backend, frozenset(structural)).made if structural else mechanism


def tunable_model(model: Any, names: Collection[str]) -> Any:
    """The model with more run-time inputs, the same one until the model changes, so that it is derived once."""
    now, wanted = _description(model), frozenset(names)
    with _LOCK:
        known = _TUNABLE.setdefault(model, {}).get(wanted)
    if known is not None and known.serves(now):
        return known.made
    found = model.with_tunable(*sorted(wanted))
    with _LOCK:
        _TUNABLE[model][wanted] = _Kept(model, now, found)
    return found


def is_known(model: Any, backend: str = "auto") -> bool:
    """Whether the mechanism of a model is there already, so that nothing can be wrong with its words."""
    return _kept(model, backend, frozenset(), derived=False) is not None


@overload
def _kept(model: Any, backend: str, tunable: frozenset[str]) -> _Kept[Mechanism]: ...
@overload
def _kept(model: Any, backend: str, tunable: frozenset[str], derived: bool) -> _Kept[Mechanism] | None: ...
def _kept(model: Any, backend: str, tunable: frozenset[str], derived: bool = True) -> _Kept[Mechanism] | None:
    """The mechanism that is known, or else is `derived`."""
    now = _description(model)
    with _LOCK:
        known = _KNOWN.setdefault(model, {}).get((backend, tunable))
    if known is not None and known.serves(now):
        return known
    words = _words(model)
    key = backend, tunable, words
    with _LOCK:
        made = _BY_WORDS.get(key) if words else None
    if made is None and not derived:
        return None
    if made is None:
        made = _derived(model, backend, tunable)
    found = _Kept(model, now, made, words is not None and words.are_fixed)
    with _LOCK:
        _KNOWN[model][backend, tunable] = found
        if words:
            _BY_WORDS[key] = made
            _BY_WORDS.move_to_end(key)
            while len(_BY_WORDS) > MAX_KEPT_BY_WORDS:
                _BY_WORDS.popitem(last=False)
    return found


def _words(model: Any) -> Words | None:
    """What the equations of a model follow from; None where they may depend on more."""
    ordinary = isinstance(model, Description) and type(model).__module__ == "mbd.model" and not model.controllers
    if not ordinary or not remembered.ENABLED:
        return None
    kinds = (model.joints, Joint), (model.forces, Force), (model.constraints, Constraint)
    if not all(isinstance(word, kind) for words, kind in kinds for word in words):
        return None
    if any(getattr(word, "reset", None) is not None for word in model.constraints):
        return None  # a run calls it, or reads it, as it is then
    points = [[*body.points.items()] for body in bodies_of(model)]
    return read_words(model.name, *_description(model), model.markers, points)


def _derived(model: Any, backend: str, tunable: frozenset[str]) -> Mechanism:
    with no_collection():
        equations = derive(model.with_tunable(*sorted(tunable)) if tunable else model)
    made = Mechanism(equations, backend)
    if made.backend.note:
        doubt(made.backend.note, of=PROCESS)
    if tunable:
        names = ", ".join(map(repr, sorted(tunable)))
        made.notes.append(
            f"derived once more with {names} as run-time input; name it in tunable=[…] of the model to avoid it"
        )
        made.without_effect = tunable - {parameter.name for parameter in made.equations.parameters}
        idle = sorted(made.without_effect)
        made.notes += [f"{name!r} enters no equation of this model: its value has no effect" for name in idle]
    return made
