"""What a public word says when it is called with arguments that it does not have.

Python names a wrong keyword but neither what it was to be nor what there is. `explained` adds both, where a name is
first asked of ``mbd``; a call that succeeds costs no more for it than a function around it.
"""

import inspect
from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any, TypeVar

from mbd.errors import SHOWN

Word = TypeVar("Word")


def explained(word: Word) -> Word:
    """The same word, whose `TypeError` for wrong arguments has the nearest right one and all that it takes."""
    if isinstance(word, type):
        begin = getattr(word, "__init__", None)
        if inspect.isfunction(begin) and not issubclass(word, BaseException):
            setattr(word, "__init__", _guarded(begin, word.__name__, 1))  # noqa: B010  (mypy lets nobody assign to it)
        return word
    if inspect.isfunction(word):
        made: Word = _guarded(word, word.__name__, 0)
        return made
    return word


def _guarded(function: Callable[..., Any], name: str, own: int) -> Any:
    """A function around another, of whose arguments the first `own` are Python's."""

    @wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        try:
            return function(*given, **named)
        except TypeError as error:
            if error.__traceback__ is None or error.__traceback__.tb_next is not None:
                raise  # not of the call, but of something inside
            own_words = str(error)
        raise TypeError(_sentence(function, name, own, given, named, own_words))

    return call


def _sentence(
    function: Callable[..., Any], name: str, own: int, given: tuple[Any, ...], named: Mapping[str, Any], own_words: str
) -> str:
    """What is wrong with the arguments, and what there is."""
    parameters = list(inspect.signature(function).parameters.values())[own:]
    known = {each.name: each for each in parameters if each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD)}
    placed = [each.name for each in known.values() if each.kind is not each.KEYWORD_ONLY][: len(given) - own]
    anything = any(each.kind is each.VAR_KEYWORD for each in parameters)
    unknown = [] if anything else [wrong for wrong in named if wrong not in known]
    faults = [f"{name} has no argument {wrong!r}{_meant(wrong, known)}" for wrong in unknown]
    faults += [f"{name} got {each!r} twice" for each in placed if each in named]
    needed = [
        f"{each.name!r}{SENSE.get(each.name, '')}"
        for each in known.values()
        if each.default is each.empty and each.name not in named and each.name not in placed
    ]
    if not faults and len(given) - own > len(placed):
        faults.append(f"{name} takes {len(placed)} arguments without a keyword, {len(given) - own} came")
    if needed and not faults:
        faults.append(f"{name} needs {', '.join(needed)}")
    shown = [_shown(each) for each in parameters]
    first = next((k for k, each in enumerate(parameters) if each.kind is each.KEYWORD_ONLY), len(parameters))
    if len(parameters) > SHOWN:  # those that may be given by place, and what has no default
        required = [k for k in range(first, len(parameters)) if parameters[k].default is inspect.Parameter.empty]
        kept = [shown[k] for k in (*range(first), *required)]
        shown = [*kept[:first], "*", *kept[first:], "…"] if first < len(parameters) else kept
    elif first < len(parameters):
        shown.insert(first, "*")
    listed = ", ".join(shown)
    more = f"; help(mbd.{name}) tells all" if len(parameters) > SHOWN else ""
    return f"{'; '.join(faults) or own_words}; it takes {name}({listed}){more}"


SENSE = {
    "until": ", the end time [s] or the name of an event",
    "start": ", a state such as mbd.assemble(model, position={…}) gives",
}
"""What an argument that is missing stands for."""


MEANT = {
    "dt": ("step", "h", "timestep", "time_step", "step_size", "stepsize", "max_step", "delta_t", "deltat"),
    "until": ("t_end", "tend", "end", "end_time", "t_final", "tf", "tmax", "t_max", "T", "t_span", "duration", "stop"),
    "integrator": ("method", "solver", "scheme"),
    "tol": ("rtol", "atol", "tolerance", "eps", "accuracy"),
    "start": ("x0", "y0", "q0", "initial", "initial_state", "state"),
    "parameters": ("params", "args", "values"),
    "position": ("q", "q0", "positions", "coordinates"),
    "velocity": ("v", "qd", "v0", "velocities", "rates"),
    "torque": ("moment", "tau"),
    "loss": ("damping", "friction", "damper", "c", "viscosity"),
    "damping": ("c", "damper"), "stiffness": ("k",), "mass": ("m",),
}  # fmt: skip
"""Words of other programs for an argument."""


def _meant(wrong: str, known: Mapping[str, Any]) -> str:
    for right, others in MEANT.items():
        if wrong in others and right in known:
            return f"; did you mean {right!r}?"
    from difflib import get_close_matches  # for errors alone

    close = get_close_matches(wrong, known, n=1, cutoff=0.6)
    return f"; did you mean {close[0]!r}?" if close else ""


def _shown(parameter: inspect.Parameter) -> str:
    """A parameter without its type, defaults that are short."""
    star = "*" * (parameter.kind is parameter.VAR_POSITIONAL) + "**" * (parameter.kind is parameter.VAR_KEYWORD)
    if parameter.default is parameter.empty:
        return f"{star}{parameter.name}"
    default = repr(parameter.default)
    return f"{parameter.name}={default if len(default) < 30 and default[0] != '<' else '…'}"
