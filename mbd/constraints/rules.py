"""When a constraint acts."""

from collections.abc import Mapping
from typing import Any

from mbd.bodies.values import flag, is_several
from mbd.constraints.measure import Measure
from mbd.constraints.user_measure import measured
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.quantities import Mention


@dataclass(frozen=True)
class When:
    """As another contact closes, this one opens; unless `may_pull` is False this replaces opening on pull.

    Parameters
    ----------
    other : name of the other contact; or the state of a mode, 'leg: flight', as which is entered this contact opens
    after_impact : False: it opens before the impact of the other and takes no impulse from it (McGeer's rule);
        True: it stays shut through the impact and opens after it
    may_pull : what happens before that where its force would pull. None: it holds as a latch does, and a note tells how
        much a foot (a contact along a distance) pulled; True: the same without a note; False: it opens then too, like a
        contact without a rule
    """

    other: str
    after_impact: bool = False
    may_pull: bool | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "after_impact", flag(self.after_impact, f"after_impact of When({self.other!r})"))
        if self.may_pull is not None:
            object.__setattr__(self, "may_pull", flag(self.may_pull, f"may_pull of When({self.other!r})"))
        if not isinstance(self.other, str) or not self.other:
            raise ModelError(f"When needs the name of another contact, such as When('right foot'), got {self.other!r}")


def releases_of(value: Any, what: str) -> tuple[When, ...]:
    """The `release=` of a contact: None, one `When`, or several."""
    several = () if value is None else (value,) if isinstance(value, When) else value
    if isinstance(several, Mapping) or not is_several(several):
        raise ModelError(f"release of '{what}' is mbd.When('name of another contact'), got {value!r}")
    result = tuple(several)
    for rule in result:
        if not isinstance(rule, When):
            raise ModelError(f"release of '{what}' is mbd.When('name of another contact'), got {rule!r}")
    return result


def condition_of(value: Any, what: str) -> str | Measure | None:
    """The `only_while=` of a contact: a name, what must be positive (a measure, a function, an expression), or None."""
    return value if value is None or isinstance(value, str) else measured(value, f"only_while of '{what}'", "a contact")


def contacts_of(condition: str | Measure | None) -> tuple[str, ...]:
    """The contact that an `only_while=` names."""
    return (condition,) if isinstance(condition, str) else ()


def mentions_of(condition: str | Measure | None) -> list[Mention]:
    """What the measure of an `only_while=` depends on."""
    return condition.mentions() if isinstance(condition, Measure) else []


def condition_details(condition: str | Measure | None) -> str:
    """What a page of text says of an `only_while=`."""
    if condition is None:
        return ""
    return f", only while {condition.details} > 0" if isinstance(condition, Measure) else f", only while '{condition}'"


def condition_faults(condition: str | Measure | None, name: str) -> list[str]:
    """An `only_while=` that names its own contact."""
    if condition != name:
        return []
    return [f"'{name}': only_while='{name}' names itself; name another contact"]
