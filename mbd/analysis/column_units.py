"""Units of columns: results by their names, parameters by what words say of their values, or by their names too."""

from collections.abc import Iterable
from typing import Any

from mbd.compile.mechanisms import mechanism_of
from mbd.results.facts import Facts
from mbd.results.units import unit

PARAMETERS = {"mass": "kg", "center": "m", "inertia": "kg m²", "length": "m", "radius": "m"}
"""Units of parameters by the last word of their names."""
ARGUMENTS = {"dt": "s", "until": "s", "time": "s", "rest_speed": "m/s"}


def units_of(model: Any, titles: Iterable[str], backend: str = "auto") -> dict[str, str]:
    """The units of columns by title; those that nobody knows are left out."""
    facts, owned = Facts.of(mechanism_of(model, backend).equations), model.parameter_check().units
    values, found = getattr(model, "parameters", {}), {}
    for title in titles:
        known = ARGUMENTS.get(title, "")
        if title in values:
            gravity = "m/s²" if title.startswith("gravity.") else ""
            known = owned.get(title) or gravity or PARAMETERS.get(title.rpartition(".")[2], "")
        found[title] = known or (unit(title, facts) if title not in values else "")
    return {title: text for title, text in found.items() if text}
