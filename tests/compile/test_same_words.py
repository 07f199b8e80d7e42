"""A model that says the same as one before has its equations; one that may mean something else has its own."""

import math
import types
from collections import defaultdict, deque
from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass
from functools import partial
from typing import Any

import numpy as np
import pytest

import mbd
import tests.comparisons
from mbd.assembly import doubtful
from mbd.compile import mechanisms
from mbd.compile.mechanisms import mechanism_of
from mbd.compile.same_words import changing
from mbd.forces.base import Force
from mbd.hardcases.shakers import table
from tests.fuzz.structures import DRIVEN, SPACE, structure
from tests.instances import CONSTRAINTS, FORCES

made = structure.__wrapped__
"""A random mechanism of a number, described again each time."""
NUMBERS = [*range(0, 160, 9), *range(SPACE, SPACE + 160, 19), *range(DRIVEN, DRIVEN + 160, 19)]


def rod(torque: Any, **words: Any) -> mbd.Model:
    model = mbd.Model("rod", **words)
    link = mbd.Link("rod", mass=1.3, length=0.7, center=0.3, inertia=0.05)
    hinge = mbd.Revolute("hinge", model.ground.origin, link.start)
    model.connect(hinge)
    model.apply(mbd.Motor("drive", hinge, torque=torque))
    return model


def end(model: mbd.Model) -> float:
    return float(mbd.simulate(model, mbd.assemble(model), dt=0.01, until=0.2)["hinge.angle"][-1])


def test_random_mechanisms_described_twice_are_derived_once_and_move_alike_to_the_bit(monkeypatch):
    shared = 0
    for number in NUMBERS[::3]:
        one, other = made(number), made(number)
        shared += mechanism_of(one.model) is mechanism_of(other.model)
        runs = []
        for _ in range(2):
            start = mbd.assemble(other.model, position=other.position, project=True)
            runs.append(mbd.simulate(other.model, start, mbd.HHT(), dt=1e-3, until=5e-3, contact="events").record)
            monkeypatch.setattr(mechanisms, "_words", lambda model: None)
            other = made(number)
        monkeypatch.undo()
        assert np.array_equal(runs[0].q, runs[1].q, equal_nan=True), number
        assert np.array_equal(runs[0].v, runs[1].v, equal_nan=True), number
    assert shared >= 0.7 * len(NUMBERS[::3])


def _numbers(words: Any, met: dict[int, Any]) -> Iterator[tuple[Any, str, float]]:
    """Every number in a field of a word, and of what the word refers to."""
    if id(words) in met:
        return
    met[id(words)] = words
    if is_dataclass(words) and not isinstance(words, type):
        for each in fields(words):
            value = getattr(words, each.name)
            if isinstance(value, float):
                yield words, each.name, value
            else:
                yield from _numbers(value, met)
    elif isinstance(words, list | tuple):
        for part in words:
            yield from _numbers(part, met)


def test_every_number_of_a_random_mechanism_counts():
    changed = 0
    for number in NUMBERS:
        model = made(number).model
        before = mechanisms._words(model)
        if before is None:
            continue
        groups = (model.joints, model.forces, model.constraints)
        for word, name, value in [*_numbers(groups, {})]:
            object.__setattr__(word, name, float(np.nextafter(value, np.inf)))
            after = mechanisms._words(model)
            object.__setattr__(word, name, value)
            assert after != before, (number, word, name)
            changed += 1
        assert mechanisms._words(model) == before
    assert changed > 300


@dataclass(frozen=True)
class Gains:
    stiff: float
    damp: float = 0.1


SIZE = 2.0


def scaled(t: Any) -> Any:
    return SIZE * mbd.sin(t)


def test_functions_are_the_same_if_all_that_they_refer_to_is(monkeypatch):
    def captured(size: Any) -> mbd.Model:
        return rod(lambda t: size * mbd.sin(t))

    def default(size: float) -> mbd.Model:
        return rod(lambda t, size=size: size * mbd.sin(t))

    def of_gains(size: float) -> mbd.Model:
        gains = Gains(size)
        return rod(lambda t: gains.stiff * mbd.sin(t))

    for make in (captured, default, of_gains):
        mechanisms._BY_WORDS.clear()
        assert (mechanism_of(make(2.0)) is mechanism_of(make(2.0))) == (make is not of_gains)
        assert end(make(3.0)) == pytest.approx(1.5 * end(make(2.0)), rel=0.01)
    first = mechanism_of(rod(scaled))
    assert mechanism_of(rod(scaled)) is first
    monkeypatch.setitem(globals(), "SIZE", 3.0)
    assert mechanism_of(rod(scaled)) is not first
    assert end(rod(scaled)) == end(captured(3.0))
    assert mechanism_of(table.__wrapped__(1.0, 9.81, 0.1, 3.0)) is not mechanism_of(
        table.__wrapped__(1.0, 9.81, 0.2, 3.0)
    )
    assert mechanism_of(rod(lambda t: mbd.sin(t))) is not mechanism_of(rod(lambda t: mbd.cos(t)))


def test_a_function_that_holds_what_can_be_changed_belongs_to_its_own_model():
    def counted(log: list[float]) -> mbd.Model:
        model = rod(0.0)
        angle = mbd.measure(lambda q: q - 0.05, "hinge.angle", unit="rad")
        model.constrain(mbd.Event("passing", angle, direction=0, reset=lambda v: log.append(1.0) or {}))
        return model

    logs = [[], []]
    for log in logs:
        model = counted(log)
        mbd.simulate(model, mbd.assemble(model, position={"hinge.angle": 0.4}), dt=0.01, until=0.5)
    assert len(logs[0]) == len(logs[1]) > 0


class Law:
    size = np.int64(2)

    def __call__(self, t: Any) -> Any:
        return self.size * mbd.sin(t)


def imported(t: Any) -> Any:
    import tests.compile.test_same_words as own

    return own.SIZE * mbd.sin(t)


@dataclass(frozen=True, slots=True)
class Slotted:
    size: float

    def __call__(self, t: Any) -> Any:
        return self.size * mbd.sin(t)


def test_words_without_functions_hold_nothing_that_changes():
    """The digest tells so of random mechanisms, of every kind of word, and of one whose law is a function."""
    models = [made(number).model for number in NUMBERS]
    for _, factory in [*FORCES, *CONSTRAINTS]:
        model = rod(1.0)
        (hinge,) = model.joints
        word = factory(hinge.child.body.point(0.1, -0.5, 0.0), model.ground.point(0.2, -0.9, 0.0), hinge)
        (model.apply if isinstance(word, Force) else model.constrain)(word)
        models.append(model)
    models.append(rod(lambda t: 2.0 * t))
    found = [(mechanisms._words(model), model) for model in models]
    fixed = [model for words, model in found if words is not None and words.are_fixed]
    assert not any(changing([model.joints, model.forces, model.constraints, model.observations]) for model in fixed)
    assert len(fixed) > 20 and not found[-1][0].are_fixed


def test_what_may_mean_something_else_later_has_no_digest():
    held = [2.0]
    laws = (
        Law(), imported, Slotted(2.0), partial(lambda size, t: size * mbd.sin(t), 2.0), Law().__call__,
        lambda t: held[0] * mbd.sin(t), lambda t: globals()["SIZE"] * mbd.sin(t), lambda t: Law.size * mbd.sin(t),
        lambda t: getattr(np, "pi") * mbd.sin(t),  # noqa: B009
        lambda t: tests.comparisons.__name__ and mbd.sin(t),
    )  # fmt: skip
    for law in laws:
        model = rod(law)
        assert mechanisms._words(model) is None, law
        assert end(model) != 0.0
    assert all(
        mechanisms._words(rod(law)) for law in (1.0, scaled, lambda t: math.pi * mbd.sin(t), lambda t: np.sin(t))
    )
    assert mechanisms._words(rod(lambda t: 2 * t)) != mechanisms._words(rod(lambda t: 2.0 * t))
    assert mechanisms._words(rod(lambda t: np.sin(t))) != mechanisms._words(rod(lambda t: np.cos(t)))


class Pull(mbd.forces.Force):
    """A force of a user's own, whose numbers can be set again."""

    kind = "applied"

    def __init__(self, joint: Any, size: float) -> None:
        self.name, self.joint, self.size = "pull", joint, size

    def parameters(self) -> dict[str, float]:
        return {}

    def mentions(self) -> list[Any]:
        return [self.joint]

    def act(self, scope: Any) -> Any:
        (rate,) = scope.joint(self.joint.name).rates
        return mbd.forces.Action(pairs=((rate, self.size),))


class Holder:
    """An object one of whose methods is a law, and another one keeps runs."""

    def __init__(self) -> None:
        self.size, self.runs = 2.0, list[Any]()

    def torque(self, t: Any) -> Any:
        return self.half() * 2.0 * mbd.sin(t)

    def half(self) -> float:
        return 0.5 * self.size

    def keep(self, run: Any) -> None:
        self.runs.append(run)


class Base:
    """What objects of a user inherit and have in one more form each."""

    __slots__ = ("inner",)
    gain = 1.0

    def __init__(self):
        self.inner = 2.0

    @property
    def size(self):
        return self.inner

    @staticmethod
    def scaled(t):
        return Inherits.gain * mbd.sin(t)


class Inherits(Base):
    """Without slots of its own."""


class Table(dict):
    """A dict of a kind of its own."""


def _laws_that_change() -> Iterator[tuple[str, Any, Any]]:
    """(what changes, a law of size 2, what makes its size 3)."""
    numbers, table, array = [2.0], {"size": 2.0}, np.array([1.0, 2.0])
    holder, law, module = types.SimpleNamespace(inner=types.SimpleNamespace(size=2.0)), Law(), tests.comparisons
    captured = 2.0

    def again() -> None:
        nonlocal captured
        captured = 3.0

    def default(t: Any, size: float = 2.0) -> Any:
        return size * mbd.sin(t)

    def keyword(t: Any, *, size: float = 2.0) -> Any:
        return size * mbd.sin(t)

    law.size, module.SIZE = 2.0, 2.0
    slotted, other, third, own = Base(), Inherits(), Inherits(), Table(size=2.0)
    counted, queue = defaultdict(float, size=2.0), deque([2.0])
    yield "list", lambda t: numbers[0] * mbd.sin(t), lambda: numbers.__setitem__(0, 3.0)
    yield "dict", lambda t: table["size"] * mbd.sin(t), lambda: table.update(size=3.0)
    yield "array", lambda t: array[1] * mbd.sin(t), lambda: array.__setitem__(1, 3.0)
    yield "attribute", lambda t: holder.inner.size * mbd.sin(t), lambda: setattr(holder.inner, "size", 3.0)
    yield "module", lambda t: tests.comparisons.SIZE * mbd.sin(t), lambda: setattr(module, "SIZE", 3.0)
    yield "captured", lambda t: captured * mbd.sin(t), again
    yield "default", default, lambda: setattr(default, "__defaults__", (3.0,))
    yield "keyword", keyword, lambda: keyword.__kwdefaults__.update(size=3.0)
    yield "callable", law, lambda: setattr(law, "size", 3.0)
    yield "method", law.__call__, lambda: setattr(law, "size", 3.0)
    yield "partial", partial(lambda held, t: held[0] * mbd.sin(t), numbers), lambda: numbers.__setitem__(0, 3.0)
    yield "inner", lambda t: scaled(t), lambda: globals().update(SIZE=3.0)
    yield "slot", lambda t: slotted.inner * mbd.sin(t), lambda: setattr(slotted, "inner", 3.0)
    yield "property", lambda t: other.size * mbd.sin(t), lambda: setattr(other, "inner", 3.0)
    yield "getattr", lambda t: getattr(third, "size") * mbd.sin(t), lambda: setattr(third, "inner", 3.0)  # noqa: B009
    yield "own dict", lambda t: own["size"] * mbd.sin(t), lambda: own.update(size=3.0)
    yield "default dict", lambda t: counted["size"] * mbd.sin(t), lambda: counted.update(size=3.0)
    yield "deque", lambda t: queue[0] * mbd.sin(t), lambda: queue.__setitem__(0, 3.0)
    Base.gain = 2.0
    yield "base class", lambda t: other.gain * mbd.sin(t), lambda: setattr(Base, "gain", 3.0)
    Base.gain = 2.0
    yield "static method", lambda t: third.scaled(t), lambda: setattr(Base, "gain", 3.0)
    members = {2.0}
    yield "set", lambda t: max(members) * (1.0 if "a" in {"a", "b"} else 0.0) * mbd.sin(t), lambda: members.add(3.0)


def test_functions_that_refer_to_something_else_by_now_are_recorded_again(monkeypatch):
    monkeypatch.setitem(globals(), "SIZE", 2.0)
    monkeypatch.setattr(tests.comparisons, "SIZE", 2.0, raising=False)
    ends = {size: end(rod(lambda t, size=size: size * mbd.sin(t))) for size in (2.0, 3.0)}
    for what, law, change in _laws_that_change():
        if what in ("method", "partial"):  # share what an earlier one has changed
            vars(law.__self__).update(size=2.0) if what == "method" else law.args[0].__setitem__(0, 2.0)
        model = rod(law)
        assert end(model) == ends[2.0], what
        assert mechanism_of(model) is mechanism_of(model)
        change()
        assert end(model) == ends[3.0], what


def test_words_of_ones_own_and_parameters_of_a_lagrangian_may_be_given_anew():
    model = rod(0.0)
    pull = Pull(model.joints[0], 2.0)
    model.apply(pull)
    before = end(model)
    pull.size = 3.0
    other = rod(0.0)
    other.apply(Pull(other.joints[0], 3.0))
    assert end(model) == end(other) != before
    y = mbd.Coordinate("y", unit="m")
    ball = mbd.Lagrangian("ball", [y], 0.1 * y.v**2, lambda y, g: 0.2 * g * y, parameters={"g": 9.81})
    falls = []
    for g in (9.81, 1.62):
        ball.parameters["g"] = g
        falls.append(mbd.simulate(ball, mbd.assemble(ball), dt=0.01, until=0.1)["y.acceleration"][0])
    assert falls == pytest.approx([-9.81, -1.62], rel=1e-12)


def test_what_runs_call_and_what_no_law_reads_leaves_equations_as_they_are(monkeypatch):
    log: list[float] = []
    model = rod(lambda t: 2.0 * mbd.sin(t))
    angle = mbd.measure(lambda q: q - 0.05, "hinge.angle", unit="rad")
    model.constrain(mbd.Event("passing", angle, direction=0, reset=lambda v: log.append(1.0) or {}))
    first = mechanism_of(model)
    holder = Holder()
    drive = rod(holder.torque)
    made = mechanism_of(drive)
    holder.runs.append(np.zeros(3))  # what other methods keep
    assert mechanism_of(drive) is made
    holder.size = 3.0
    assert mechanism_of(drive) is not made
    monkeypatch.setitem(globals(), "sin", 2.0)  # the name of an attribute that the law asks mbd for
    log.append(0.0)
    assert mechanism_of(model) is first


def test_named_points_gravity_and_names_of_inputs_count():
    first = mechanism_of(rod(1.0))
    pointed = rod(1.0)
    pointed.joints[0].child.body.point(0.0, -0.5, 0.0, name="mark")
    assert mechanism_of(pointed) is not first
    assert "rod.mark.x" in mbd.simulate(pointed, mbd.assemble(pointed), dt=0.01, until=0.02).names
    assert mechanism_of(rod(1.0, gravity=(0.0, -1.6, 0.0))) is not first
    assert mechanism_of(rod(1.0, tunable=["gravity.x"])) is not first
    assert mechanism_of(rod(1.0)) is first


def test_doubts_are_those_of_the_words_and_looked_for_once(monkeypatch):
    asked, doubts = [], doubtful.doubts
    monkeypatch.setattr(doubtful, "doubts", lambda model: (asked.append(model), doubts(model))[1])
    for _ in range(2):
        model = rod(1.25)
        mbd.assemble(model)
        model.gravity = (0.0, 9.81, 0.0)
        with pytest.warns(mbd.MbdWarning, match="pulls upwards"):
            mbd.assemble(model)
    assert len(asked) == 2


def test_only_the_last_few_are_kept():
    for k in range(3 * mechanisms.MAX_KEPT_BY_WORDS):
        mechanism_of(rod(1.0 + 0.1 * k))
    assert len(mechanisms._BY_WORDS) == mechanisms.MAX_KEPT_BY_WORDS
