"""Files of failures: numbers and words as in the file of a run, the model pickled beside them."""

from __future__ import annotations

import json
import pickle
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from mbd.errors import TrajectoryError
from mbd.results.failure import Failure
from mbd.results.states import pack, pack_state, unpack
from mbd.results.storage import Arrays, plain, read, write

__all__ = ["FORMAT", "load", "packed", "save", "unpacked"]

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
    return Failure(**values, settings=content["settings"], integrator=_made(content["integrator"]))


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
    return getattr(mbd.integrators, described["class"])(**described["parameters"])


def save(failure: Failure, path: str | Path) -> Path:
    """Write a failure; see `Failure.save`."""
    target = Path(path)
    if not target.suffix:
        target = target.with_name(target.name + SUFFIX)
    arrays: Arrays = {}
    meta = {"format": FORMAT, "version": VERSION, "failure": packed(failure, arrays), "model": ""}
    own = {"model": failure.model, "integrator": failure.integrator, "state": failure.state}
    try:
        arrays["pickle"] = np.frombuffer(pickle.dumps(own), dtype=np.uint8)
    except Exception as error:  # a function without a name, an object of the user's: pickle raises what it likes
        meta["model"] = f"{type(error).__name__}: {error}"
    arrays["meta"] = np.frombuffer(json.dumps(meta, default=plain).encode(), dtype=np.uint8)
    write(target, arrays)
    return target


def load(path: str | Path, model: Any = None) -> Failure:
    """Read a failure; with a model given the pickle in the file is not read."""
    arrays, meta = read(Path(path), FORMAT, VERSION, "failure.save(…)")
    failure = unpacked(meta["failure"], arrays)
    if model is not None:
        return replace(failure, model=model)
    if "pickle" not in arrays:
        raise TrajectoryError(
            f"'{path}' holds no model, it could not be pickled ({meta['model']}); give it: replay(…, model=model)"
        )
    try:
        own = pickle.loads(arrays["pickle"].tobytes())
    except Exception as error:  # modules that are not there, classes that have changed: anything
        raise TrajectoryError(
            f"the model in '{path}' cannot be read here ({type(error).__name__}: {error}); give it: "
            "replay(…, model=model)"
        ) from error
    return replace(failure, model=own["model"], integrator=own["integrator"], state=own["state"])
