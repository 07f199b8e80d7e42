"""Published values that runs are judged by, in place of a reference of the lab's own."""

import math
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from mbd.analysis.accuracy.compare import Difference
from mbd.arrays import Vector
from mbd.bodies.values import is_number
from mbd.dataclass import dataclass
from mbd.errors import ModelError, SimulationError, UnknownNameError, nearest
from mbd.integrators import Integrator
from mbd.results.trajectory import Trajectory
from mbd.simulation.run.user_calls import call_user


@dataclass(frozen=True)
class Known:
    """A value that is known without integrating, and how a run tells it.

    Parameters
    ----------
    value : in the unit of what `of` answers; errors are relative to its size, and absolute where it is 0
    accuracy : of the value itself, absolute
    of : a result, read at the end of a run; or ``of(run)``, which answers a number, or a row of numbers each of which
        should be the value, the last of them at the end; default the result by whose name the value is given
    """

    value: float
    accuracy: float = 0.0
    of: str | Callable[[Trajectory], Any] | None = None


@dataclass(frozen=True, eq=False)
class Published:
    """What judges runs by known values; it answers what `Truth` answers.

    known : by quantity
    """

    known: Mapping[str, Known]

    method = "published values"
    event_bound, seconds = 0.0, 0.0
    same_events = True
    growth: ClassVar[float | None] = None

    @cached_property
    def scales(self) -> dict[str, float]:
        """What errors are divided by."""
        return {name: abs(each.value) or 1.0 for name, each in self.known.items()}

    @cached_property
    def bound(self) -> dict[str, float]:
        """Accuracy of each value, relative like the errors [-]; never less than the round-off of its number."""
        return {
            name: max(each.accuracy / self.scales[name], float(np.finfo(float).eps))
            for name, each in self.known.items()
        }  # fmt: skip

    @property
    def error(self) -> float:
        """The largest bound of all quantities [-]."""
        return max(self.bound.values())

    @property
    def origin(self) -> str:
        """What they are, in a sentence."""
        texts = (f"{name} = {each.value:.12g} ± {each.accuracy:.1g}" for name, each in self.known.items())
        return f"{self.method}: {', '.join(texts)}"

    @property
    def struck(self) -> bool:
        """Whether there are impacts: not known."""
        return False

    def is_kin(self, scheme: Integrator) -> bool:
        """No scheme has found them."""
        return False

    def bound_of(self, scheme: Integrator) -> Mapping[str, float]:
        """What they are known to, whoever is judged."""
        return self.bound

    def unlike(self, run: Trajectory) -> str:
        """Nothing is known of where the run ends."""
        return ""

    def achieved(self, run: Trajectory) -> float | None:
        """Errors of coordinates are not known."""
        return None

    def judged(self, run: Trajectory) -> Difference:
        """Errors of what a run tells.

        Raises
        ------
        SimulationError
            where a user's function raises, or a run tells no finite number.
        """
        largest, at_end = {}, {}
        for name, each in self.known.items():
            gaps = np.abs(_value_in(name, each, run) - each.value) / self.scales[name]
            largest[name], at_end[name] = float(np.max(gaps)), float(gaps[-1])
        return Difference(largest, at_end, 0.0, True, 0.0)

    def remark(self, found: Difference) -> str:
        """The error of each quantity, where there are several."""
        if len(self.known) == 1:
            return ""
        texts = []
        for name, size in found.largest.items():
            end = found.at_end[name]
            texts.append(f"{name} {size:.1e}" + (f" ({end:.1e} at the end)" if end < 0.9 * size else ""))
        return ", ".join(texts)


def _value_in(name: str, known: Known, run: Trajectory) -> Vector:
    """What a run tells of a quantity, (k,)."""
    if callable(known.of):
        values = call_user(f"the function that tells {name!r} of a run", known.of, run)
    else:
        values = run[known.of or name][-1]
    try:
        numbers = np.atleast_1d(np.asarray(values, dtype=float)).ravel()
    except (TypeError, ValueError) as error:
        raise SimulationError(f"{name!r} must be a number or a row of numbers, not {values!r}") from error
    if not numbers.size or not np.all(np.isfinite(numbers)):
        raise SimulationError(f"this run tells no finite {name!r}")
    return numbers


def published(known: Mapping[str, Any], probe: Trajectory) -> Published:
    """Checked values: numbers or `Known`, by the name of a result or, with a function, by any name."""
    values = {name: each if isinstance(each, Known) else Known(each) for name, each in known.items()}
    faults, wrong = [], []
    for name, each in values.items():
        if not is_number(each.value) or not math.isfinite(each.value):
            faults.append(f"the known value of {name!r} must be a number, not {each.value!r}")
        if not is_number(each.accuracy) or not 0.0 <= each.accuracy < math.inf:
            faults.append(f"the accuracy of {name!r} must be a number from 0 on, not {each.accuracy!r}")
        if each.of is not None and not isinstance(each.of, str) and not callable(each.of):
            faults.append(f"'of' of {name!r} must be the name of a result or a function of the run, not {each.of!r}")
        elif not callable(each.of) and not _is_scalar(each.of or name, probe):
            wrong.append(each.of or name)
    unknown = [
        f"{nearest(name, probe.names, 'quantity')}; or give mbd.Known(value, of=function of the run)" for name in wrong
    ]
    if faults:
        raise ModelError([*faults, *unknown])
    if unknown:
        raise UnknownNameError(unknown)
    return Published(values)


def _is_scalar(name: str, probe: Trajectory) -> bool:
    return name in probe and len(probe.columns.components(name)) == 1


def table_of(known: Any) -> Mapping[str, Any]:
    """What is given as known values, if it is a dictionary by name.

    Raises
    ------
    ModelError
        for anything else.
    """
    if not isinstance(known, Mapping) or not known or not all(isinstance(name, str) for name in known):
        raise ModelError(
            f"known must be a dictionary such as {{'pin.angle': mbd.Known(1.0, accuracy=1e-9)}}, not {known!r}"
        )
    return known
