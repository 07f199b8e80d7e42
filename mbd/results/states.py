"""States in plain words and arrays, and back."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.errors import TrajectoryError

HOMES = ("mbd.state", "mbd.results.record", "mbd.integrators.stepping")
"""The modules whose dataclasses a file may name."""
RETIRED = ("NewmarkMemory", "RadauMemory", "RungeKuttaMemory")
"""What older files may hold of steps in Python: a run that continues from them starts its scheme again."""


def pack_state(state: Any, arrays: dict[str, NDArray[Any]]) -> Any:
    """A state; without its memory where that holds objects of the user's, which a file cannot keep."""
    try:
        kept: dict[str, NDArray[Any]] = dict(arrays)
        packed = pack(state, kept)
    except TrajectoryError:
        if getattr(state, "memory", None) is None:
            raise
        return pack(replace(state, memory=None), arrays)
    arrays.update(kept)
    return packed


def pack(value: Any, arrays: dict[str, NDArray[Any]]) -> Any:
    """A dataclass of ours, or what its fields hold, for JSON; arrays go into `arrays`."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        key = f"state {len(arrays)}"
        arrays[key] = value
        return {"array": key}
    if isinstance(value, frozenset | set):
        return {"set": sorted(value)}
    if isinstance(value, tuple | list):
        return {"list" if isinstance(value, list) else "tuple": [pack(item, arrays) for item in value]}
    if isinstance(value, Mapping):
        return {"mapping": [[pack(key, arrays), pack(item, arrays)] for key, item in value.items()]}
    home = type(value).__module__
    if is_dataclass(value) and not isinstance(value, type) and home in HOMES:
        content = {item.name: pack(getattr(value, item.name), arrays) for item in fields(value) if item.init}
        return {"class": type(value).__name__, "home": home, "fields": content}
    raise TrajectoryError(f"the final state of a run holds a {type(value).__name__}, which a file cannot keep")


def unpack(value: Any, arrays: Mapping[str, NDArray[Any]]) -> Any:
    """What `pack` was given."""
    if not isinstance(value, dict):
        return value
    if "array" in value:
        return arrays[value["array"]]
    if "set" in value:
        return frozenset(value["set"])
    if "tuple" in value:
        return tuple(unpack(item, arrays) for item in value["tuple"])
    if "list" in value:
        return [unpack(item, arrays) for item in value["list"]]
    if "mapping" in value:
        return {unpack(key, arrays): unpack(item, arrays) for key, item in value["mapping"]}
    if value["class"] in RETIRED:
        return None
    home = value.get("home", HOMES[0])
    kind = getattr(import_module(home), value["class"], None) if home in HOMES else None
    if not (isinstance(kind, type) and is_dataclass(kind)):
        raise TrajectoryError(
            f"the file's final state holds a {value['class']!r}, which this mbd does not have; update mbd"
        )
    return kind(**{name: unpack(item, arrays) for name, item in value["fields"].items()})
