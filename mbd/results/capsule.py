"""Files of failures: numbers and words as in the file of a run, the model pickled beside them."""

import json
import pickle
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from mbd.errors import TrajectoryError
from mbd.results.archive import Arrays, Members, Unreadable, named_file, plain, read, write
from mbd.results.content import arrays_within, expect, of_kind
from mbd.results.failure import Failure
from mbd.results.record import EventRecord
from mbd.results.states import pack, pack_state, unpack
from mbd.state import State, malformed

FORMAT, VERSION = "mbd failure", 1

SUFFIX = ".failure.npz"
"""Added to a path without an extension."""

APART = ("model", "integrator", "state", "settings")
"""Fields that are not simply packed."""


def packed(failure: Failure, arrays: Arrays) -> dict[str, Any]:
    """A failure for JSON, without its model; arrays go into `arrays`."""
    content = {
        item.name: pack(getattr(failure, item.name), arrays) for item in fields(failure) if item.name not in APART
    }
    content["state"] = pack_state(failure.state, arrays)
    content["settings"] = json.loads(json.dumps(dict(failure.settings), default=plain))
    content["integrator"] = _described(failure.integrator)
    return content


def unpacked(content: Mapping[str, Any], arrays: Mapping[str, Any]) -> Failure:
    """What `packed` was given; its model is None."""
    values = {name: unpack(value, arrays) for name, value in content.items() if name not in ("integrator", "settings")}
    failure = Failure(**values, settings=content["settings"], integrator=_made(content["integrator"]))
    for state in (failure.state, failure.candidate):
        expect(isinstance(state, State) and not malformed(state), "a state")
    for name in ("time", "attempted", "residual", "dt"):
        of_kind(getattr(failure, name), int | float, f"{name!r}")
    of_kind(failure.message, str, "'message'")
    of_kind(failure.iterations, int, "'iterations'")
    for name in ("residuals", "parameters", "settings"):
        of_kind(getattr(failure, name), dict, f"{name!r}")
    expect(all(isinstance(event, EventRecord) for event in (*failure.events, *failure.undone)), "'events'")
    return failure


def _described(integrator: Any) -> dict[str, Any]:
    """An integrator of ours by its class and parameters, another by its printed form."""
    import mbd.integrators

    kind = type(integrator)
    if getattr(mbd.integrators, kind.__name__, None) is not kind:
        return {"printed": repr(integrator)}
    parameters = {"start" if name == "starting" else name: value for name, value in vars(integrator).items()}
    return {"class": kind.__name__, "parameters": parameters}


def _made(described: Mapping[str, Any]) -> Any:
    """The integrator; of one that is not ours its printed form."""
    import mbd.integrators

    if "class" not in described:
        return described["printed"]
    kind = getattr(mbd.integrators, described["class"], None)
    if not (isinstance(kind, type) and issubclass(kind, mbd.integrators.Integrator)):
        raise Unreadable(f"there is no integrator {described['class']!r}")
    return kind(**described["parameters"])


def save(failure: Failure, path: str | Path) -> Path:
    """Write a failure; see `Failure.save`."""
    target = named_file(path, SUFFIX)
    arrays: Arrays = {}
    meta = {"format": FORMAT, "version": VERSION, "failure": packed(failure, arrays), "model": ""}
    own = {"model": failure.model, "integrator": failure.integrator, "state": failure.state}
    try:
        arrays["pickle"] = np.frombuffer(pickle.dumps(own), dtype=np.uint8)
    except Exception as error:  # a function without a name, an object of the user's: pickle raises what it likes
        meta["model"] = f"{type(error).__name__}: {error}"
    write(target, arrays, meta)
    return target


def load(path: str | Path, model: Any = None, trusted: bool = False) -> Failure:
    """Read a failure; the pickle in the file is read only if it is `trusted`, and no model given."""
    failure, pickled, problem = read(Path(path), FORMAT, VERSION, "failure.save(…)", _wanted, _parts)
    if model is not None:
        return replace(failure, model=model)
    if pickled is None:
        raise TrajectoryError(
            f"'{path}' holds no model, it could not be pickled ({problem}); give it: replay(…, model=model)"
        )
    if not trusted:
        raise TrajectoryError(
            f"the model in '{path}' is pickled, and a pickle may run any code; give the model: replay(…, model=model), "
            "or, if you know who wrote the file, replay(…, trusted=True)"
        )
    try:
        own = pickle.loads(pickled)
        return replace(failure, model=own["model"], integrator=own["integrator"], state=own["state"])
    except Exception as error:  # modules that are not there, classes that have changed: anything
        raise TrajectoryError(
            f"the model in '{path}' cannot be read here ({type(error).__name__}: {error}); give it: "
            "replay(…, model=model)"
        ) from error


def _wanted(meta: dict[str, Any], members: Members) -> set[str]:
    """Names of the arrays of a failure."""
    of_kind(meta["model"], str, "'model'")
    return arrays_within(meta["failure"]) | ({"pickle"} & members.names)


def _parts(meta: dict[str, Any], arrays: Arrays) -> tuple[Failure, bytes | None, str]:
    """The failure, the pickle beside it, which is not read, and why there is none."""
    pickled = arrays["pickle"].tobytes() if "pickle" in arrays else None
    return unpacked(meta["failure"], arrays), pickled, meta["model"]
