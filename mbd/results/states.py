"""The final state of a run in plain words and arrays, and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.errors import TrajectoryError

__all__ = ["pack", "unpack"]

HOME = "mbd.state"
"""The module whose dataclasses a file may name."""


def pack(value: Any, arrays: dict[str, NDArray[Any]]) -> Any:
    """A dataclass of `mbd.state`, or what its fields hold, for JSON; arrays go into `arrays`."""
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
        return {"tuple": [pack(item, arrays) for item in value]}
    if isinstance(value, Mapping):
        return {"mapping": [[pack(key, arrays), pack(item, arrays)] for key, item in value.items()]}
    if is_dataclass(value) and not isinstance(value, type) and type(value).__module__ == HOME:
        content = {item.name: pack(getattr(value, item.name), arrays) for item in fields(value) if item.init}
        return {"class": type(value).__name__, "fields": content}
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
    if "mapping" in value:
        return {unpack(key, arrays): unpack(item, arrays) for key, item in value["mapping"]}
    import mbd.state

    kind = getattr(mbd.state, value["class"], None)
    if not (isinstance(kind, type) and is_dataclass(kind)):
        raise TrajectoryError(
            f"the file's final state is a {value['class']!r}, which this mbd does not have; update mbd"
        )
    return kind(**{name: unpack(item, arrays) for name, item in value["fields"].items()})
