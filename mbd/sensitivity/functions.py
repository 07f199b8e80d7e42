"""Functions of parameters: one quantity, such as a slope, on which several parameters depend."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mbd.bodies.values import is_number, shown
from mbd.equal import EQUAL_RTOL
from mbd.errors import ModelError
from mbd.tape.derivatives import jvp
from mbd.tape.evaluate import evaluate
from mbd.tape.node import Tape
from mbd.tape.tracing import traced_scalar

__all__ = ["rates_of_parameters"]


def rates_of_parameters(
    name: str, functions: Mapping[str, Any], at: Mapping[str, float], known: Mapping[str, float]
) -> dict[str, float]:
    """Derivatives of parameters by a quantity on which they depend.

    Parameters
    ----------
    functions : of one scalar, by the name of the parameter that they give; or a number, the derivative itself
    at : the value of each quantity
    known : the parameters of the run, which the functions must give

    Raises
    ------
    ModelError
        where the value is missing, or functions give other parameters than the run has.
    """
    rates: dict[str, float] = {}
    for parameter, function in functions.items():
        if is_number(function):
            rates[parameter] = float(function)
            continue
        if not callable(function):
            raise ModelError(f"wrt: {parameter!r} of {name!r} must be a function or a number, not {shown(function)}")
        if name not in at:
            raise ModelError(f"wrt: {name!r} is a function of parameters: give its value too, as at={{{name!r}: 0.05}}")
        tape = Tape()
        place = tape.input("p", 0)
        node = traced_scalar(function, [(name, place)], f"{parameter!r} as a function of {name!r}", tape)
        value, rate = evaluate([node, *jvp([node], {place: 1.0})], {("p", 0): at[name]})
        present = known.get(parameter)
        if present is not None and not abs(value - present) <= EQUAL_RTOL * max(abs(present), abs(value), 1e-3):
            raise ModelError(
                f"wrt: {parameter!r} is {value:.9g} at {name} = {at[name]:.9g}, but {present:.9g} in the run; give the "
                "run these parameters, or at= the value that it has"
            )
        rates[parameter] = rate
    return rates
