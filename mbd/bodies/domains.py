"""Which values the parameters of a word may have: declared once, held wherever a value is given."""

from collections.abc import Callable, Iterable, Mapping
from math import inf

from mbd.bodies.values import named_number_faults
from mbd.dataclass import dataclass


@dataclass(frozen=True)
class Domain:
    """The values that a parameter may have: an interval, from which single values may be taken out.

    Parameters
    ----------
    low, high : bounds, which belong to it
    excluded : values between them that do not
    problem : what is wrong with any other value, and what to try: 'is negative; give a mass ≥ 0'
    unit : of the value, for messages
    called : what it is called there, where not by the last part of its name

    >>> Domain(low=0.0, unit="kg").faults("body 'rod'", "mass", -1.0)
    ["body 'rod': mass -1 kg is below 0; give a value ≥ 0"]
    """

    low: float = -inf
    high: float = inf
    excluded: tuple[float, ...] = ()
    problem: str = ""
    unit: str = ""
    called: str = ""

    def __contains__(self, value: float) -> bool:
        return self.low <= value <= self.high and value not in self.excluded

    def faults(self, owner: str, field: str, value: float) -> list[str]:
        """One sentence where a value lies outside."""
        if value in self:
            return []
        unit = f" {self.unit}" if self.unit else ""
        return [f"{owner}: {self.called or field} {value:g}{unit} {self.problem or self._said(value)}"]

    def _said(self, value: float) -> str:
        """What is wrong with a value, from the bounds alone."""
        if value < self.low:
            return f"is below {self.low:g}; give a value ≥ {self.low:g}"
        if value > self.high:
            return f"is above {self.high:g}; give a value ≤ {self.high:g}"
        return f"is not allowed; give another value than {' or '.join(f'{each:g}' for each in self.excluded)}"


def at_least_zero(problem: str = "is negative; give a value ≥ 0", unit: str = "") -> Domain:
    """Values ≥ 0."""
    return Domain(low=0.0, problem=problem, unit=unit)


def positive(problem: str = "is not positive; give a value > 0", unit: str = "") -> Domain:
    """Values > 0."""
    return Domain(low=0.0, excluded=(0.0,), problem=problem, unit=unit)


class Parameterized:
    """What bodies, joints, forces and constraints have in common: parameters, and what they may be.

    A word declares the domains of its parameters; they hold for the values that it is made with, for those of
    ``parameters=`` in every function that takes it, and for those that a controller writes. Without a domain, a
    parameter may have any finite value.
    """

    name: str

    def parameters(self) -> dict[str, float]:
        """Run-time parameters by full name: {'left thigh.mass': 0.5, …}."""
        return {}

    def laws(self) -> tuple[str, ...]:
        """Full names of quantities that are functions, expressions or samples, and may be inputs of a linearization."""
        return ()

    def domains(self) -> dict[str, Domain]:
        """Domains of its parameters by full name, of those that have one."""
        return {}

    def stands_for(self) -> dict[str, str]:
        """Parameters that take the place of others: {'knee loss.coefficient.stance': 'knee loss.coefficient'}."""
        return {}

    @property
    def known_as(self) -> str:
        """What messages call it: "body 'rod'"."""
        return f"'{self.name}'"

    def value_faults(self, values: Mapping[str, float]) -> list[str]:
        """What is wrong with some values of its parameters, one sentence each.

        To judge several parameters together, such as moments of inertia, a word adds to what this gives.

        Parameters
        ----------
        values : by full name, of all its parameters at least
        """
        return [
            fault
            for name, domain in self.domains().items()
            if name in values
            for fault in domain.faults(self.known_as, name.removeprefix(self.name)[1:], values[name])
        ]

    def faults(self) -> list[str]:
        """What is physically impossible about it, one sentence each."""
        return self.value_faults(self.parameters())


class ParameterCheck:
    """Judges values of parameters that differ from those of a model, by the words that own them.

    Parameters
    ----------
    words : in order; where two have a parameter of one name, it is that of the first
    values : the model's own, by full name
    whole : judges what several words decide together, from all values
    decisive : names of the parameters that it looks at
    """

    def __init__(
        self,
        words: Iterable[Parameterized],
        values: Mapping[str, float],
        whole: Callable[[Mapping[str, float]], list[str]] = lambda values: [],
        decisive: Iterable[str] = (),
    ) -> None:
        self._values, self._whole, self._decisive = dict(values), whole, frozenset(decisive)
        self._owner: dict[str, Parameterized] = {}
        self._names: dict[int, list[str]] = {}
        self._stands_for: dict[str, str] = {}
        for word in words:
            self._stands_for |= word.stands_for()
            for name in word.parameters():
                if self._owner.setdefault(name, word) is word:
                    self._names.setdefault(id(word), []).append(name)

    def stand_in_faults(self) -> list[str]:
        """What is wrong with the model's own values of parameters that take the place of others."""
        return self.faults({name: self._values[name] for name in self._stands_for if name in self._values})

    @property
    def units(self) -> dict[str, str]:
        """Units of the parameters whose words tell one."""
        words = {id(word): word for word in self._owner.values()}
        domains = {name: domain for word in words.values() for name, domain in word.domains().items()}
        return {name: domain.unit for name, domain in domains.items() if domain.unit}

    def faults(self, changed: Mapping[str, float], names: Iterable[str] | None = None) -> list[str]:
        """What is wrong with changed values; with those of some names only, if these are given."""
        names = changed if names is None else tuple(names)
        found = named_number_faults({name: changed[name] for name in names}, "parameters")
        if found:
            return found
        owners = {id(self._owner[name]): self._owner[name] for name in names if name in self._owner}
        for number, word in owners.items():
            found += word.value_faults(self._own(number, changed))
        for name in names:
            other = self._stands_for.get(name, "")
            if word_of := self._owner.get(other):
                there = self._own(id(word_of), {other: changed[name]})
                found += [f"{name!r}: {fault}" for fault in word_of.value_faults(there)]
        if not self._decisive.isdisjoint(names):
            found += self._whole({**self._values, **changed})
        return list(dict.fromkeys(found))

    def _own(self, number: int, changed: Mapping[str, float]) -> dict[str, float]:
        """Values of the parameters of a word; one that the model has no number of is 0, as the rest of no spring."""
        return {name: changed.get(name, self._values.get(name, 0.0)) for name in self._names[number]}
