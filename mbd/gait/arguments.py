"""What may be given to a search for gaits: every fault of the arguments, said before the first run."""

from collections.abc import Callable, Mapping
from typing import Any

from mbd.bodies.values import among, is_finite_number, named_number_faults, names_given, shown
from mbd.compile.mechanism import Mechanism
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.integrators import Integrator
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.state import State, malformed

LEAST, MOST = 1e-15, 1e9
"""Bounds of steps, times and tolerances that anybody can mean [s, m, rad]."""

Functions = Mapping[str, Callable[[float], Mapping[str, float]]]
"""Functions of one value that give parameters: ``{"slope": lambda s: {"gravity.x": 9.81 * sin(s)}}``."""


def check_arguments(
    start: Any, integrator: Any, strides: Any, numbers: Mapping[str, Any], parameters: Any, functions: Any,
    wrt: Any, on_failure: Any,
) -> None:  # fmt: skip
    """Raise one `ModelError` with all that is wrong; `numbers` must be positive; dt may be None."""
    faults = malformed(start) if isinstance(start, State) else [
        f"start must be a State from mbd.assemble(model, …), not {shown(start)}"
    ]  # fmt: skip
    if not isinstance(integrator, Integrator):
        faults.append(f"integrator must be a scheme such as mbd.RungeKutta853(), not {shown(integrator)}")
    if isinstance(strides, bool) or not isinstance(strides, int) or not 1 <= strides <= 1000:
        faults.append(f"strides must be a whole number from 1 to 1000, not {shown(strides)}")
    for name, value in numbers.items():
        if (value is None and name == "dt") or (is_finite_number(value) and LEAST <= value <= MOST):
            continue
        faults.append(f"{name} must be a positive number up to {MOST:g}, not {shown(value)}")
    faults += named_number_faults(parameters, "parameters") + _function_faults(functions, parameters)
    faults += names_given(wrt, "wrt", "parameters, such as ['hip.mass']")[1]
    if not among(on_failure, ("raise", "return")):
        faults.append(f"on_failure={shown(on_failure)} is not available; use 'raise' or 'return'")
    if faults:
        raise ModelError(faults)


def _function_faults(functions: Any, parameters: Any) -> list[str]:
    """What is wrong with functions of parameters; each is tried at its value."""
    if functions is None:
        return []
    if not isinstance(functions, Mapping):
        return [f"functions must map names to functions that give parameters, not {shown(functions)}"]
    faults = []
    for name, function in functions.items():
        if not isinstance(name, str) or not callable(function):
            faults.append(f"functions: {name!r} must be a name with a function, not {shown(function)}")
        elif not isinstance(parameters, Mapping) or name not in parameters:
            faults.append(f"functions has {name!r}; give its value too, as parameters={{{name!r}: …}}")
        elif is_finite_number(parameters[name]):
            faults += _answer_faults(name, function, parameters[name])
    return faults


def _answer_faults(name: str, function: Any, value: Any) -> list[str]:
    try:
        answer = function(float(value))
    except Exception as error:  # the user's own
        return [f"functions: {name!r} at {value:g} raises {type(error).__name__}: {error}"]
    return named_number_faults(answer, f"functions: what {name!r} gives") if isinstance(answer, Mapping) else [
        f"functions: {name!r} must give parameters by name, such as {{'gravity.x': 0.5}}, not {shown(answer)}"
    ]  # fmt: skip


def section_named(manager: ActiveSetManager, section: Any) -> str:
    """The name of the event at which a return ends."""
    known = [*manager.names, *(guard.name for guard in manager.guards)]
    if not isinstance(section, str):
        raise ModelError(f"section must be the name of a contact or event, such as 'right foot', not {shown(section)}")
    if section not in known:
        raise UnknownNameError("section: " + nearest(section, known, "contact or event"))
    terminal = [guard.name for guard in manager.guards if guard.terminal]
    if section in terminal:
        raise ModelError(f"section={section!r} is an event that ends runs; a walk does not go on from there")
    return section


def increments_named(mechanism: Mechanism, modulo: Any) -> tuple[int, ...]:
    """Numbers of the increments of the coordinates named in `modulo`."""
    names, faults = names_given(modulo, "modulo", "coordinates, such as ['trunk.x']")
    if faults:
        raise ModelError(faults)
    freedoms = [name for name, _ in mechanism.equations.configuration.freedoms]
    wrong = ["modulo: " + nearest(name, freedoms, "coordinate") for name in names if name not in freedoms]
    if wrong:
        raise UnknownNameError(wrong)
    return tuple(sorted(freedoms.index(name) for name in names))
