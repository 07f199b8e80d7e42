"""What a compiled scheme is to the kernel: its functions, the memory that it needs, what it is able to do.

A scheme is a module of this folder with an entry ``SCHEME = Scheme(…)`` and its line in `SCHEMES`; an integrator names
it (`mbd.integrators.base.Integrator.scheme`) and gives its parameters (`numbers`). Nothing else asks which scheme it
is: its abilities are numbers of the kernel's record, and its functions are called as ``scheme_start``, ``scheme_step``,
``scheme_accept``, ``scheme_resume`` and ``scheme_error`` (`mbd.kernel.hooks`), which `dispatch` makes.

The functions are compiled with all that they call, from any module: they use what `mbd.kernel.translate` knows of
Python.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import lru_cache
from importlib import import_module
from types import FunctionType
from typing import Any, Literal

import numpy as np

from mbd.arrays import Vector
from mbd.errors import CapabilityError
from mbd.kernel.hints import shown
from mbd.kernel.records import Kernel, Sizes

__all__ = ["MEMORY", "NO_SCHEME", "SCHEMES", "Abilities", "Scheme", "dispatch", "number_of", "scheme_named", "schemes"]

SCHEMES: tuple[str, ...] = (
    "mbd.kernel.schemes.newmark",
    "mbd.kernel.schemes.runge_kutta",
    "mbd.kernel.schemes.radau",
)
"""Modules of the schemes that the kernel is built with; a scheme has its place here as its number."""


MEMORY = ("stages", "past_stages", "tableau")
"""Arrays whose lengths an entry may ask for."""


@dataclass(frozen=True)
class Abilities:
    """What the rest of the kernel goes by: fields of its record of the same names. Defaults are those of order 2.

    explicit : 1: a step solves no equations, so that it may be as short as one likes, and leaves consistent multipliers
    estimates : 1: steps leave an estimate of their error in K.error; 0: changes of accelerations that the last step did
        not foretell are judged as the error of a scheme of order 2
    look_twice : estimated error of a rate, over the rate, above which forces are evaluated for another look [-]
    error_constant : of the error in positions, over the third power of the step times the rate of accelerations [-]
    most_growth : factor from one step to the next where steps follow a tolerance [-]
    singular_size : 1: next to singular configurations the size of steps is chosen so that none has a node there
        (`mbd.kernel.singular.step_size`), for which the scheme calls `note_row_norms` and its neighbours; 0: it steps
        over them itself, or does not notice them
    stretches : 1: the step over one may last longer than others even where guards are watched
    middle : part of a step at which a singular configuration lies best, amid the widest gap between nodes [-]
    far_look, longest_over : steps to one below which it is looked for where round-off asks for a longer step over it,
        and the longest such step, in steps of the grid [-]
    """

    explicit: int = 0
    estimates: int = 0
    singular_size: int = 0
    stretches: int = 0
    look_twice: float = 0.01
    error_constant: float = 0.0
    most_growth: float = 2.0
    middle: float = 0.5
    far_look: float = 14.0
    longest_over: float = 16.0


HOOKS = {
    "start": ("K: Kernel", "int"),
    "step": ("K: Kernel, h: float, t1: float", "int"),
    "accept": ("K: Kernel, h: float", "None"),
    "resume": ("K: Kernel, h: float", "int"),
    "error": ("K: Kernel, h: float", "None"),
}
"""Arguments and results of the functions of an entry."""


def _nothing(sizes: Sizes) -> dict[str, int]:
    return {}


@dataclass(frozen=True, eq=False)
class Scheme:
    """An entry.

    name : by which integrators name it
    start : ``start(K) → status``: memory at the accepted, consistent state
    step : ``step(K, h, t1) → status``: the candidate (q1, y1, rate1, aux1, lam1) at t1 = t + h, the accepted state
        untouched, with velocities, rates and multipliers in the block
    accept : ``accept(K, h)``: the candidate becomes the accepted state, the rates of change K.slope and K.lam_slope and
        K.aux_step = h included
    resume : ``resume(K, h) → status``: a start with the rates in K.jump and the multipliers in K.impulse that keeps
        what the scheme averages; only of schemes that set K.near_singular to `LEFT`
    error : ``error(K, h)``: K.error of the candidate; None: steps have left it there
    abilities : see `Abilities`
    nodes : of a step, in parts of it, but for its end
    programs : kind of the model code that steps call: 'mode', 'stepping' with factors in straight-line code, 'explicit'
    stability : largest ω dt at which it is stable, infinite for implicit schemes [-]
    memory : lengths of "stages", "past_stages" (kept from step to step) and "tableau" by the sizes of the mechanism
    coefficients : what these arrays begin with
    """

    name: str
    start: Callable[[Kernel], int]
    step: Callable[[Kernel, float, float], int]
    accept: Callable[[Kernel, float], None]
    resume: Callable[[Kernel, float], int] | None = None
    error: Callable[[Kernel, float], None] | None = None
    abilities: Abilities = Abilities()
    nodes: tuple[float, ...] = ()
    programs: Literal["mode", "stepping", "explicit"] = "mode"
    stability: float = np.inf
    memory: Callable[[Kernel], dict[str, int]] = _nothing
    coefficients: Callable[[], dict[str, Vector]] = dict

    def __post_init__(self) -> None:
        for hook, (arguments, result) in HOOKS.items() if self.name else ():
            if getattr(self, hook) is not None:
                _check_hook(self.name, hook, getattr(self, hook), arguments, result)

    def numbers(self) -> dict[str, Any]:
        """Its abilities by the names of the kernel's fields."""
        return {each.name: getattr(self.abilities, each.name) for each in fields(Abilities)} | {
            "n_nodes": len(self.nodes), "scheme": number_of(self.name),
        }  # fmt: skip


def _check_hook(scheme: str, hook: str, function: Any, arguments: str, result: str) -> None:
    """Refuse a function of an entry that the kernel could not call, by its name and place."""
    wanted = [each.partition(": ")[::2] for each in arguments.split(", ")]
    call = f"{hook}({', '.join(name for name, _ in wanted)})"
    who = f"the scheme {scheme!r}: expected a function {call} of a module as its {hook!r}, came "
    if not isinstance(function, FunctionType) or function.__qualname__ != function.__name__ or "<" in function.__name__:
        raise CapabilityError(f"{who}{function!r}")
    place = f"{shown(function.__code__.co_filename)}:{function.__code__.co_firstlineno}"
    parameters = inspect.signature(function).parameters
    if [*parameters] != [name for name, _ in wanted]:
        raise CapabilityError(f"{who}{function.__name__}({', '.join(map(str, parameters.values()))}), {place}")
    told = {name: getattr(kind, "__name__", str(kind)) for name, kind in function.__annotations__.items()}
    for name, kind in (*wanted[1:], ("return", result)):
        if told.get(name, kind) != kind:
            raise CapabilityError(f"{who}one whose {name!r} is {told[name]!r} in place of {kind!r}, {place}")


def _no_step(*given: Any) -> int:
    raise NotImplementedError


NO_SCHEME = Scheme("", _no_step, _no_step, _no_step)  # type: ignore[arg-type]
"""In place of an entry for integrators that are written in Python only."""


@lru_cache(maxsize=8)
def _entries(modules: tuple[str, ...]) -> tuple[Scheme, ...]:
    return tuple(import_module(module).SCHEME for module in modules)


def schemes() -> tuple[Scheme, ...]:
    """All entries, in the order of `SCHEMES`."""
    return _entries(SCHEMES)


def scheme_named(name: str) -> Scheme:
    """The entry of a name; `NO_SCHEME` for ''.

    Raises
    ------
    CapabilityError
        for a name that none in the list has.
    """
    if not name:
        return NO_SCHEME
    found = {scheme.name: scheme for scheme in schemes()}
    if name not in found:
        raise CapabilityError(
            f"the integrator names the compiled scheme {name!r}, which no entry has: there are "
            f"{', '.join(map(repr, found))}; add its module to mbd.kernel.schemes.contract.SCHEMES"
        )
    return found[name]


def number_of(name: str) -> int:
    """The place of a scheme among them; 0 for a name that none has."""
    return next((number for number, scheme in enumerate(schemes()) if scheme.name == name), 0)


def dispatch() -> tuple[str, dict[str, Any]]:
    """Python text of the kernel's ``scheme_step`` and its neighbours, and what the names in it mean.

    Each calls the function of the scheme ``K.scheme``; which one is not asked for that all schemes share or one has.
    """
    lines, names = list[str](), dict[str, Any]()
    for hook, (arguments, result) in HOOKS.items():
        given = ", ".join(argument.partition(":")[0] for argument in arguments.split(", "))
        own = [(k, f"{hook}_{k}") for k, each in enumerate(schemes()) if getattr(each, hook)]
        names |= {alias: getattr(schemes()[k], hook) for k, alias in own}
        lines.append(f"def scheme_{hook}({arguments}) -> {result}:")
        answer = "return " if result == "int" else ""
        last = own.pop(0) if result == "int" or len(own) == len(schemes()) else None  # who has none is never asked
        for turn, (number, function) in enumerate(own):
            lines.append(f"    {'elif' if turn else 'if'} K.scheme == {number}:\n        {answer}{function}({given})")
        if last:
            indent = "    else:\n        " if own else "    "
            lines.append(f"{indent}{answer}{last[1]}({given})")
        lines.append("")
    return "\n".join(lines), names
