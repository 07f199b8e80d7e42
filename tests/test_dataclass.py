"""Dataclasses made at their first use are those of the standard library."""

import copy
import dataclasses
import inspect
import pickle
import sys
import textwrap
from concurrent.futures import ThreadPoolExecutor
from dataclasses import KW_ONLY, FrozenInstanceError, field, fields, is_dataclass, replace
from types import ModuleType
from typing import Any, ClassVar

import pytest

from mbd.dataclass import dataclass


@dataclass(frozen=True)
class Base:
    """A base."""

    name: str = field(kw_only=True, default="x")
    sizes: tuple[float, ...] = ()
    table: dict[str, float] = field(default_factory=dict, repr=False)
    kind: ClassVar[str] = "base"


@dataclass(frozen=True)
class Derived(Base):
    """Ends with what its base has not."""

    length: float = 2.0
    _: KW_ONLY
    width: float = field(default=1.0, compare=False)
    area: float = field(init=False)
    marks: list[int] = field(init=False, default_factory=list)

    def __post_init__(self) -> None:
        object.__setattr__(self, "area", self.length * self.width)


def twins(options: str, body: str) -> tuple[Any, Any]:
    """The same class made by each of the two."""
    made = []
    for source in ("mbd.dataclass", "dataclasses"):
        module = ModuleType(f"made_by_{source}")
        sys.modules[module.__name__] = module
        imports = f"from dataclasses import KW_ONLY, field\nfrom {source} import dataclass\n"
        text = f"{imports}@dataclass{options}\nclass A:\n    'Documented'\n"
        exec(text + textwrap.indent(body, "    "), vars(module))
        made.append(vars(module)["A"])
    return made[0], made[1]


BODIES = (
    "x: tuple = ()",
    "x: float\ny: float = field(default=1.0, hash=False)\nz: list = field(default_factory=list, compare=False)",
    "x: float\ny: float = 2.0",
    "x: float = 1.0\n_: KW_ONLY\ny: float\nz: list = field(default_factory=list)",
    "x: float\ny: float = field(default=3.0, repr=False, compare=False)\n"
    "def __post_init__(self):\n    self.__dict__['z'] = 1",
    "x: float\ny: float = field(init=False, default=7.0)\ndef __repr__(self):\n    return 'mine'",
    "x: float\ny: float = field(kw_only=True, default=7.0)\ndef __eq__(self, other):\n    return False",
    "x: float\ny: float = field(default=7.0, hash=False)\ndef __hash__(self):\n    return 5",
    "x: float\ndef __init__(self, x, y=1.0):\n    self.__dict__['x'] = x",
    "pass",
)


def outcome(work: Any) -> Any:
    """What comes out, or the kind and the sentence of what is raised."""
    try:
        found = work()
    except Exception as error:
        return type(error), str(error)
    return found


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("options", ["", "(eq=False)", "(frozen=True)", "(frozen=True, eq=False)", "(repr=False)"])
@pytest.mark.parametrize("first", range(16))
def test_a_class_is_the_one_of_the_standard_library_whatever_is_asked_first(
    options: str, body: str, first: int
) -> None:
    def asked(kind: Any) -> list[Any]:
        def one(*given: Any, **named: Any) -> Any:
            return kind(*given, **named)

        questions = [
            lambda: str(inspect.signature(kind)),
            lambda: (one(1.0) == one(1.0), one(1.0) == one(2.0), one(1.0) == 1.0, one(1.0) != one(1.0)),
            lambda: len({hash(each) for each in [one(1.0, y=2.0), one(1.0, y=2.0)]}),
            lambda: repr(one(1.0, y=2.0)).replace("mbd.dataclass", "dataclasses").partition(" at ")[0],
            lambda: setattr(one(1.0), "x", 4.0),
            lambda: delattr(one(1.0), "x"),
            lambda: setattr(one(1.0), "w", 4.0),
            lambda: vars(type("Part", (kind,), {})(1.0)) | {"w": setattr(type("Part", (kind,), {})(1.0), "w", 4.0)},
            lambda: setattr(type("Part", (kind,), {})(1.0), "x", 4.0),
            lambda: repr(kind.__dataclass_params__).partition("frozen")[2],
            lambda: [(each.name, each.type, each.init, each.kw_only) for each in fields(kind)],
            lambda: kind.__match_args__,
            lambda: vars(replace(one(1.0, y=2.0), x=5.0)),
            lambda: vars(copy.copy(one(1.0, y=2.0))),
            lambda: one(1, 2, 3, 4, 5),
            lambda: (is_dataclass(kind), kind.__hash__ is None, kind.__qualname__, kind.__init__.__qualname__),
        ]
        return [outcome(question) for question in questions[first:] + questions[:first]]

    ours, theirs = twins(options, body)
    assert asked(ours) == asked(theirs)


def test_classes_inherit_copy_and_refuse_as_usual() -> None:
    assert [each.name for each in fields(Derived)] == ["name", "sizes", "table", "length", "width", "area", "marks"]
    one = Derived((1.0,), {"a": 1.0}, 3.0, width=2.0, name="n")
    assert (one.area, one.marks, one.name) == (6.0, [], "n")
    assert pickle.loads(pickle.dumps(one)) == one == replace(one, length=3.0)
    with pytest.raises(FrozenInstanceError):
        one.length = 1.0  # type: ignore[misc]

    @dataclasses.dataclass(frozen=True)
    class Users(Derived):
        mine: float = 4.0

    assert Users(mine=2.0).area == 2.0


def test_threads_may_make_the_first_object_at_once() -> None:
    for _ in range(50):
        kind, _ = twins("(frozen=True)", "x: float\ny: float = 2.0")
        with ThreadPoolExecutor(8) as pool:
            assert {made.x for made in pool.map(kind, range(8))} == set(range(8))
