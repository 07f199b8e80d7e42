"""Look for gaits from many starts, and say how each went."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from typing import Any, Literal

import numpy as np

from mbd.arrays import Matrix
from mbd.assembly.assemble import assemble
from mbd.bodies.values import among, flag, is_finite_number, shown
from mbd.dataclass import dataclass
from mbd.equal import NOMINAL_RTOL
from mbd.errors import AssemblyError, GaitError, MbdError, ModelError, UnknownNameError
from mbd.gait.arguments import Functions, check_arguments
from mbd.gait.cycle import LimitCycle
from mbd.gait.family import Member, member_of
from mbd.gait.limit_cycle import FIRST_STEP, map_of
from mbd.gait.outcome import Outcome
from mbd.gait.return_map import ReturnMap
from mbd.gait.search import Failed, Search, fallen_first, first_found, first_return, on_section
from mbd.integrators import Integrator, RungeKutta853
from mbd.notebook import table
from mbd.progress import share_bar
from mbd.state import State

MAX_TRIES = 1_000_000
"""Tries of one search at most."""

CURES = {
    "scuffs": (
        "a swing foot touches the ground as it passes; let it pass with only_while= of its contact (feet of mbd.parts "
        "take it), bend the knee, or shorten the leg in swing"
    ),
    "falls": "start nearer to a walk: take narrower ranges, a smaller slope, or legs that swing faster",
    "misses": "the section is not reached; name the contact or event that ends each step, or give a larger longest=",
    "cannot be assembled": "no posture has these values with these contacts closed; leave one value out, or widen it",
    "wrong contacts": "a step ends on other contacts than it began with; give mirror= for walkers with two like legs",
    "rests": "the walker comes to rest; give a steeper slope or faster rates",
    "does not converge": "the starts are far from a gait; take narrower ranges around one that nearly repeats itself",
    "numerical error": "look at the first such try in .tries; a smaller dt= resolves stiff or light parts",
}
"""What to try against outcomes of `Outcome.kind` where no gait was found."""


@dataclass(frozen=True, eq=False)
class Try:
    """One start: the values that were drawn, what became of it, and the number of its gait (−1: none)."""

    values: Mapping[str, float]
    outcome: Outcome
    gait: int = -1


@dataclass(frozen=True, eq=False)
class GaitSearch:
    """What a search found.

    gaits : different ones, stable ones first, then by falling speed; tries : every start with its outcome
    complete : False where Ctrl-C ended it
    """

    name: str
    gaits: tuple[LimitCycle, ...]
    tries: tuple[Try, ...]
    complete: bool = True

    @property
    def gait(self) -> LimitCycle:
        """The first of `gaits`.

        Raises
        ------
        GaitError
            if there is none, with what the tries came to.
        """
        if not self.gaits:
            cure = f"; {self.advice()}" if self.advice() else ""
            raise GaitError(f"{self.name}: no gait in {self._tries_made()}: {self._counts()}{cure}", self)
        return self.gaits[0]

    def outcomes(self) -> dict[str, int]:
        """How many tries came to what, the most frequent first."""
        kinds = Counter(each.outcome.text.partition(" at ")[0].partition(":")[0] for each in self.tries)
        return dict(kinds.most_common())

    def _counts(self) -> str:
        return ", ".join(f"{count} × {text}" for text, count in self.outcomes().items())

    def _tries_made(self) -> str:
        return "1 try" if len(self.tries) == 1 else f"{len(self.tries)} tries"

    def advice(self) -> str:
        """What to try against the most frequent outcome; '' where gaits were found, or nothing is known to help."""
        most = Counter(each.outcome.kind for each in self.tries).most_common(1)
        return "" if self.gaits or not most else CURES.get(most[0][0], "")

    def __repr__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        found = "1 gait" if len(self.gaits) == 1 else f"{len(self.gaits)} gaits"
        ended = "" if self.complete else " (interrupted)"
        yield f"{self.name}: {found} in {self._tries_made()}{ended}: {self._counts()}"
        for number, gait in enumerate(self.gaits):
            reached = sum(each.gait == number for each in self.tries)
            yield f"  {gait!r}, from {reached} {'try' if reached == 1 else 'tries'}"
        if self.advice():
            yield f"  {self.advice()}"

    def _repr_html_(self) -> str:
        names = list(self.tries[0].values) if self.tries else []
        rows = [
            [str(k + 1), *(f"{each.values[name]:.4g}" for name in names), str(each.outcome)]
            for k, each in enumerate(self.tries)
        ]
        return table(f"tries of {self.name}", ("try", *names, "outcome"), rows, self._counts())


@dataclass(eq=False)
class _Hunt:
    """The state of a search: its map and section as soon as one try has found a gait."""

    map: ReturnMap
    tol: float
    dt: float | None
    found: list[LimitCycle] = field(default_factory=list)
    given: Search | None = None
    member: Member | None = None

    def one(self, start: State, values: Mapping[str, float]) -> tuple[Outcome, int]:
        """What becomes of a start; the number of its gait."""
        all_values = {**self.map.values, **values}
        given, dt = self.given, self.dt
        states: tuple[State, ...] = ()
        if given is not None:
            # so far [m, rad] a start is moved
            near, dt = on_section(given.section, start, self.map.vector(all_values), 1.0), given.map.dt
            states = () if near is None else (near,)
        if not states:
            begun = first_return(self.map, start, all_values)
            if isinstance(begun, Failed):
                return begun.outcome, -1
            given, states = given or Search(self.map, begun[0], self.tol, self.member), begun[1]
        assert given is not None
        gait = fallen_first(first_found(given, states, all_values, dt), start, all_values)
        if not gait.success:
            return gait.outcome, -1
        self.given = gait.given
        return gait.outcome, self._known(gait)

    def _known(self, gait: LimitCycle) -> int:
        """The number of a gait, which is new where no other is the same."""
        for number, other in enumerate(self.found):
            ahead = other.chart.of(gait.state)
            same = (
                abs(other.period - gait.period) <= NOMINAL_RTOL and np.max(np.abs(ahead), initial=0.0) <= NOMINAL_RTOL
            )
            if same and other.parameters == gait.parameters:
                return number
        self.found.append(gait)
        return len(self.found) - 1


def find_gait(
    model: Any,
    position: Mapping[str, Any],
    velocity: Mapping[str, Any],
    integrator: Integrator | None = None,
    *,
    closed: Iterable[str],
    open: Iterable[str] = (),
    section: str,
    mirror: tuple[str, str] | None = None,
    strides: int = 1,
    tries: int = 64,
    design: Literal["sobol", "latin hypercube"] = "sobol",
    seed: int = 0,
    dt: float | None = None,
    tol: float = 1e-10,
    parameters: Mapping[str, Any] | None = None,
    functions: Functions | None = None,
    energy: float | None = None,
    speed: float | None = None,
    anchors: Mapping[str, Any] | None = None,
    modulo: Iterable[str] | None = None,
    longest: float = 30.0,
    all_gaits: bool = False,
    progress: bool = True,
    backend: str = "auto",
) -> GaitSearch:
    """The first stable gait, or all gaits, from a design of starts; how each try went is kept by name.

    Parameters
    ----------
    model : a `Model` or `Lagrangian`
    position, velocity : of the starts, as for `mbd.assemble`; a pair (low, high) in the place of a number is varied;
        orientations and vectors stay as they are, components of angular velocities may vary
    integrator, section, mirror, strides, dt, tol, functions, energy, speed, modulo, longest, backend : as for
        `mbd.limit_cycle`
    closed, open, anchors : contacts that start closed, and open, and places of feet, as for `mbd.assemble`
    tries : how many starts at most
    all_gaits : True for every try to be made; otherwise the search ends with the first stable gait
    progress : whether a bar counts the tries, on a terminal or in a notebook
    design : 'sobol' or 'latin hypercube' (`scipy.stats.qmc`), with `seed`
    parameters : values by name, pairs of which are varied too; then gaits differ in them

    Returns
    -------
    GaitSearch
        whose `gait` is the first stable one; no try is lost, whatever came of it. Ctrl-C keeps those that are made.

    Raises
    ------
    ModelError, UnknownNameError
        for arguments that cannot be meant, before the first run.
    """
    scheme, member = RungeKutta853() if integrator is None else integrator, member_of(energy, speed)
    groups = {"position": position, "velocity": velocity, "parameters": {} if parameters is None else parameters}
    fixed, ranges = _varied(groups, tries, design, seed)
    points = _points(len(ranges), tries, design, seed)
    every, shown_bar = flag(all_gaits, "all_gaits of find_gait"), flag(progress, "progress of find_gait")
    names = [_title(group, name) for group, name, _ in ranges]
    hunt: _Hunt | None = None
    tried, complete = list[Try](), True
    with share_bar(shown_bar) as bar:
        try:
            for point in points:
                draw = _drawn(fixed, ranges, point)
                start = _assembled(model, draw, closed, open, anchors, backend)
                if hunt is None and isinstance(start, State):
                    given, settings = {**draw["parameters"]}, {"dt": dt, "tol": tol, "longest": longest}
                    check_arguments(start, scheme, strides, settings, given, functions, (), "return")
                    kind = (section, mirror, strides)
                    map_ = map_of(
                        model, start, scheme, dt or FIRST_STEP, kind, given, functions, modulo, longest, backend
                    )
                    hunt = _Hunt(map_, tol, dt, member=member)
                    for other in points if ranges else ():
                        hunt.map.require({**hunt.map.values, **_drawn(fixed, ranges, other)["parameters"]})
                tried.append(_tried(hunt, draw, start, names))
                if bar is not None:
                    bar(len(tried), len(points))
                if not every and hunt is not None and any(gait.stability == "stable" for gait in hunt.found):
                    break
        except KeyboardInterrupt:
            complete = False
    if hunt is None:
        return GaitSearch(getattr(model, "name", ""), (), tuple(tried), complete)
    order = sorted(range(len(hunt.found)), key=lambda k: _rank(hunt.found[k]))
    place = {old: new for new, old in enumerate(order)} | {-1: -1}
    return GaitSearch(
        getattr(model, "name", ""), tuple(hunt.found[k] for k in order),
        tuple(Try(each.values, each.outcome, place[each.gait]) for each in tried), complete,
    )  # fmt: skip


def _tried(
    hunt: _Hunt | None, draw: Mapping[str, Mapping[str, float]], start: State | Outcome, names: Sequence[str]
) -> Try:
    """One try; what goes wrong in it is its outcome."""
    values = _values(draw, names)
    if hunt is None or isinstance(start, Outcome):
        assert isinstance(start, Outcome)
        return Try(values, start)
    try:
        outcome, number = hunt.one(start, draw["parameters"])
    except (MbdError, ArithmeticError, np.linalg.LinAlgError) as error:
        return Try(values, Outcome("numerical error", f"numerical error: {error}"))
    return Try(values, outcome, number)


def _rank(gait: LimitCycle) -> tuple[bool, float]:
    """Stable gaits first, fast ones first."""
    return gait.stability != "stable", -gait.speed if np.isfinite(gait.speed) else gait.period


def _varied(groups: Mapping[str, Any], tries: Any, design: Any, seed: Any) -> tuple[dict[str, Any], list[Any]]:
    """The values that stay, and (group, name, (low, high)) of those that vary; every fault at once."""
    faults, ranges = [], []
    fixed: dict[str, dict[str, float]] = {group: {} for group in groups}
    for group, values in groups.items():
        if not isinstance(values, Mapping):
            faults.append(f"{group} must map names to numbers or pairs (low, high), not {shown(values)}")
            continue
        for name, value in values.items():
            pair = isinstance(value, tuple | list) and len(value) == 2
            if pair and all(map(is_finite_number, value)) and value[0] < value[1]:
                ranges.append((group, name, (float(value[0]), float(value[1]))))
            elif is_finite_number(value):
                fixed[group][name] = float(value)
            elif group != "parameters" and _is_whole(value):
                fixed[group][name] = value
            else:
                faults.append(
                    f"{group}: {name!r} must be a number or a pair (low, high)"
                    + ("" if group == "parameters" else ", or an orientation or a vector as a whole")
                    + f", not {shown(value)}"
                )
    if isinstance(tries, bool) or not isinstance(tries, int) or not 1 <= tries <= MAX_TRIES:
        faults.append(f"tries must be a whole number from 1 to {MAX_TRIES}, not {shown(tries)}")
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        faults.append(f"seed must be a whole number from 0 on, not {shown(seed)}")
    if not among(design, ("sobol", "latin hypercube")):
        faults.append(f"design={shown(design)} is not available; use 'sobol' or 'latin hypercube'")
    if faults:
        raise ModelError(faults)
    return fixed, ranges


def _is_whole(value: Any) -> bool:
    """Whether it is an orientation or a vector, which `mbd.assemble` judges: a rotation, three numbers or more, an axis
    with an angle, a sequence with angles.
    """
    if hasattr(value, "as_quat"):
        return True
    if not isinstance(value, tuple | list | np.ndarray):
        return False
    return len(value) >= 3 or (len(value) == 2 and isinstance(value[0], tuple | list | np.ndarray | str))


def _points(size: int, tries: int, design: str, seed: int) -> Matrix:
    """(tries, size) points of the unit cube."""
    if size == 0:
        return np.zeros((1, 0))
    from scipy.stats import qmc

    if design == "sobol":
        power = max(int(np.ceil(np.log2(tries))), 0)
        return np.asarray(qmc.Sobol(size, seed=seed).random_base2(power)[:tries])
    return np.asarray(qmc.LatinHypercube(size, seed=seed).random(tries))


def _drawn(fixed: Mapping[str, Mapping[str, float]], ranges: Sequence[Any], point: Any) -> dict[str, dict[str, float]]:
    """The values of one try, by group and name."""
    found = {group: dict(values) for group, values in fixed.items()}
    for (group, name, (low, high)), share in zip(ranges, point, strict=True):
        found[group][name] = low + (high - low) * float(share)
    return found


def _values(draw: Mapping[str, Mapping[str, float]], names: Sequence[str]) -> dict[str, float]:
    """What varied, by name."""
    whole = {_title(group, name): value for group, values in draw.items() for name, value in values.items()}
    return {name: whole[name] for name in names}


def _title(group: str, name: str) -> str:
    """A name in tables; a rate may be given by its coordinate's name."""
    return f"{name}.rate" if group == "velocity" and not name.endswith("rate") else name


def _assembled(
    model: Any, draw: Mapping[str, Any], closed: Any, opened: Any, anchors: Any, backend: str
) -> State | Outcome:  # fmt: skip
    """The start of a try; a posture that no motion has is an outcome."""
    try:
        return assemble(model, draw["position"], draw["velocity"], closed, opened, anchors=anchors, backend=backend)
    except UnknownNameError:
        raise
    except AssemblyError as error:
        return Outcome("cannot be assembled", f"cannot be assembled: {error}", 0.0)
