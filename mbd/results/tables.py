"""Runs as tables of pandas and xarray."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mbd.trajectory import Trajectory

__all__ = ["dataframe", "dataset", "library"]


def library(name: str, extra: str, purpose: str) -> Any:
    """An optional library, or the error that says how to install it."""
    from importlib import import_module

    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        top = name.partition(".")[0]
        if error.name != top:
            raise
        text = f"{purpose} needs {top}, which is not installed; try: pip install 'mbd[{extra}]'"
        raise ModuleNotFoundError(text, name=top) from None


def dataframe(run: Trajectory, names: Sequence[str] | None = None) -> Any:
    """A pandas DataFrame: `time` as index, a column per scalar; a vector's name gives three columns."""
    pandas = library("pandas", "data", "run.to_dataframe()")
    wanted = run.names if names is None else names
    scalars = list(dict.fromkeys(part for name in wanted for part in run.columns.components(name)))
    columns = dict(zip(scalars, run.columns.at_rows(scalars), strict=True))
    return pandas.DataFrame(columns, index=pandas.Index(run.time, name="time"))


def dataset(run: Trajectory, names: Sequence[str] | None = None) -> Any:
    """An xarray Dataset over `time`, units in the attributes where they are known."""
    xarray = library("xarray", "data", "run.to_xarray()")
    wanted = run.names if names is None else names
    units = dict(run.facts.coordinates)
    variables = {}
    scalars = [name for name in wanted if run.columns.knows(name)]
    found = dict(zip(scalars, run.columns.at_rows(scalars), strict=True))
    for name in wanted:
        value = found[name] if name in found else run[name]
        dimensions = ("time",) if value.ndim == 1 else ("time", "axis")
        variables[name] = (dimensions, value, {"units": units[name]} if name in units else {})
    axes = {"axis": ["x", "y", "z"]} if any(value[0] == ("time", "axis") for value in variables.values()) else {}
    coordinates = {"time": ("time", run.time, {"units": "s"}), **axes}
    return xarray.Dataset(variables, coords=coordinates, attrs={"model": run.name, "message": run.message})
