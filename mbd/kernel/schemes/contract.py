"""What a compiled scheme is to the kernel: its functions, the memory that it needs, what it is able to do.

A scheme is a module of this folder with an entry ``SCHEME = Scheme(…)`` and its line in `SCHEMES`; an integrator names
it (`mbd.integrators.base.Integrator.scheme`) and gives its parameters (`numbers`). Nothing else asks which scheme it
is: its abilities are numbers of the kernel's record, and its functions are called as ``scheme_start``, ``scheme_step``,
``scheme_accept``, ``scheme_resume`` and ``scheme_error`` (`mbd.kernel.hooks`), which `dispatch` makes.

The functions are compiled with all that they call, from any module: they use what `translation.translate` knows of
Python.
"""

import inspect
from collections.abc import Callable
from dataclasses import fields
from functools import lru_cache
from importlib import import_module
from types import FunctionType
from typing import Any, Literal

import numpy as np

from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.errors import CapabilityError
from mbd.kernel.records import Kernel, Sizes
from mbd.kernel.stepping.restart import take_consistent
from mbd.kernel.translation.hints import shown

SCHEMES: tuple[str, ...] = (
    "mbd.kernel.schemes.newmark",
    "mbd.kernel.schemes.runge_kutta",
    "mbd.kernel.schemes.radau",
    "mbd.kernel.schemes.runge_kutta_4",
)
"""Modules of the schemes that the kernel is built with; a scheme has its place here as its number."""


MEMORY = ("stages", "past_stages", "tableau", "coupled", "coupled_rhs", "coupled_pivots")
"""Arrays whose lengths an entry may ask for."""


@dataclass(frozen=True)
class Abilities:
    """What the rest of the kernel goes by: fields of its record of the same names, each with who asks for it.

    The defaults are those of an implicit scheme of order 2 without an estimate of its error, which is right, if not the
    fastest, for any other. All are pure numbers.

    explicit : 1: a step solves no equations. Then it may be as short as one likes (`guards.try_step`, `advance`: short
        steps of others are taken in another way), one that fails as energy comes from nowhere is not tried shorter
        (`step_retry`), and multipliers are those of the balance, shared among dependent rows (`guards`)
    estimates : 1: `step` itself leaves the local error in K.error, which judges whether the step resolves the motion
        (`resolution`); 0: changes of rates that the last slope did not predict do, as the error h³/12 of the
        trapezoidal rule
    look_twice : local error of a rate, over the rate, above which forces are evaluated again to see whether the step
        follows them at all (`resolution`); larger for schemes of high order, whose estimates are pessimistic
    error_constant : C of the local error C h³ d³q/dt³ of positions: `newmark_error` multiplies by it, and `resolution`
        allows less growth in a step where |C| > 1/12; 0 for schemes of higher order
    stability : largest ω dt at which an explicit scheme is stable: `stability` refuses steps beyond it that are rough
    most_growth : factor from one step to the next where steps follow a tolerance (`control`); below the limit of
        stability of multistep schemes, such as 1 + √2 of BDF2
    second_look : what tells of forces that the estimate may not see, of the stages of an explicit formula in K.stages
        (`resolution`): 1: how far they are from a straight line; 2: the second estimate of its tableau; 0: nothing
    singular_size : 1: where constraint Jacobians lose rank, steps are sized so that none has a node close by
        (`singular.step_size`, `control`, `step_retry`): the scheme calls `forget_row_norms` in `start`,
        `note_row_norms` in `step` and `accept_row_norms` in `accept`. 0: `solve_step` steps over them, for which
        `step` begins with `if K.near_singular == PASSING: return singular_newmark_step(K, h, t1)`; or nobody does
    stretches : 1: a step over one may last longer than dt even where guards are watched (`singular.step_size`)
    middle : part of a step at which it lies best, amid the widest gap between `nodes` (`singular.step_size`)
    far_look, longest_over : in steps of the grid: how far ahead one is looked for where round-off asks for a longer
        step over it, and the longest such step (`singular.step_size`, `step_retry`)
    """

    explicit: int = 0
    estimates: int = 0
    second_look: int = 0
    singular_size: int = 0
    stretches: int = 0
    look_twice: float = 0.01
    error_constant: float = 0.0
    stability: float = np.inf
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

    A record begins each call as it was accepted: time, q, y = (v, z), rate = (v̇, ż), lam; n_active rows act, whose
    numbers are in K.rows. Results are 0 or a code of `mbd.kernel.codes`. `mbd.testing.check_scheme` tries all this.

    name : by which integrators name it (`CompiledIntegrator.scheme`)
    start : ``start(K) → status``: memory at the accepted, consistent state, as the run begins and behind every switch;
        what steps remember is forgotten (`forget_steps`), sizes of forces are known (`refresh_scales`)
    step : ``step(K, h, t1) → status``: the candidate (q1, y1, rate1, aux1, lam1) at t1 = t + h, the accepted state
        untouched, with velocities, rates and multipliers in the block; h is any size, often another than before
    accept : ``accept(K, h)``: the candidate becomes the accepted state, the rates of change K.slope and K.lam_slope and
        K.aux_step = h included
    resume : ``resume(K, h) → status``: a start with the rates in K.jump and the multipliers in K.impulse that keeps
        what the scheme averages, where K.near_singular was set to `LEFT`, as `solve_step` does; None: `start` from them
    error : ``error(K, h)``: the local error of the candidate in K.error, of x, then of (v, z), for ``tol=``
        (`control`); None: steps have left it there, or the integrator refuses a tolerance (`check_tolerance`)
    abilities : see `Abilities`
    nodes : parts of a step at which there are stages, in rising order, but for its end (`singular.step_size`); ()
    programs : the model code that steps call (`Stepper.add_mode`): 'mode': residual and tangent, factored here;
        'stepping': the same, factored in straight-line code where that pays, as `solve_step` takes it; 'explicit': none
        but accelerations, rows and their Jacobian
    memory : lengths of "stages" (work), "past_stages" (kept from step to step), "tableau", and of "coupled", its
        "coupled_rhs" and "coupled_pivots", one matrix for all stages, by the sizes of the mechanism (`Stepper`); an
        array that is used without a length is refused as the kernel is built
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
    who = f"the scheme {scheme!r}: expected a function {call} of a module as its {hook!r}, got "
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


@lru_cache(maxsize=64)
def _entry(module: str) -> Scheme:
    entry: Scheme = import_module(module).SCHEME
    return entry


def schemes() -> tuple[Scheme, ...]:
    """All entries, in the order of `SCHEMES`."""
    return tuple(map(_entry, SCHEMES))


def scheme_named(name: str) -> Scheme:
    """The entry of a name; `NO_SCHEME` for ''.

    Raises
    ------
    CapabilityError
        for a name that none in the list has.
    """
    if not name:
        return NO_SCHEME
    found = next((scheme for scheme in map(_entry, SCHEMES) if scheme.name == name), None)  # imports none behind it
    if found is None:
        raise CapabilityError(
            f"the integrator names the compiled scheme {name!r}, which no entry has: there are "
            f"{', '.join(repr(scheme.name) for scheme in schemes())}; add its module to "
            "mbd.kernel.schemes.contract.SCHEMES"
        )
    return found


def number_of(name: str) -> int:
    """The place of a scheme among them; 0 for a name that none has."""
    return next((number for number, scheme in enumerate(map(_entry, SCHEMES)) if scheme.name == name), 0)


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
        general = hook == "resume"  # who has none starts from the rates that are there
        last = own.pop(0) if not general and (result == "int" or len(own) == len(schemes())) else None
        for turn, (number, function) in enumerate(own):
            lines.append(f"    {'elif' if turn else 'if'} K.scheme == {number}:\n        {answer}{function}({given})")
        if last:
            indent = "    else:\n        " if own else "    "
            lines.append(f"{indent}{answer}{last[1]}({given})")
        lines.append("    take_consistent(K)\n    return scheme_start(K)\n" if general else "")
    return "\n".join(lines), names | {"take_consistent": take_consistent}
