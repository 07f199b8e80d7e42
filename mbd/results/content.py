"""What the words of a file must be, and which arrays of which shapes they call for; anything else is refused."""

from collections.abc import Mapping, Sequence
from typing import Any

from mbd.bodies.rigid_body import FORMS
from mbd.bodies.values import among, printable
from mbd.equations.held import HELD_BY
from mbd.equations.shapes import NUMBERS
from mbd.integrators.extension import EXTENSIONS, HERMITE
from mbd.joints.anatomy import ANATOMY
from mbd.results.archive import Head, Members, Unreadable

STATE = {"q": "q", "v": "v", "z": "z", "a": "v", "s": "z", "lam": "lam"}
"""Parts of the state, each with the one whose shape it has."""
KINDS = ("closed", "opened", "event", "stuck", "slipped", "pushed")
"""Kinds of events."""


def expect(holds: bool, what: str) -> None:
    """Refuse the file where something does not hold."""
    if not holds:
        raise Unreadable(f"{what} is not as a run writes it")


def of_kind(value: Any, kind: Any, what: str) -> Any:
    """A value of one of these types; a flag is no number."""
    expect(isinstance(value, kind) and not (isinstance(value, bool) and kind is not bool), what)
    return value


def _list(value: Any, kind: Any, what: str) -> Sequence[Any]:
    for item in of_kind(value, list, what):
        of_kind(item, kind, what)
    return value  # type: ignore[no-any-return]


def _pairs(value: Any, what: str) -> Sequence[Any]:
    for pair in _list(value, list, what):
        expect(len(pair) == 2 and all(isinstance(word, str) for word in pair), what)
    return value  # type: ignore[no-any-return]


def arrays_within(packed: Any, depth: int = 0) -> set[str]:
    """Names of the arrays that a packed dataclass refers to."""
    expect(depth < 20, "a nested state")
    found: set[str] = set()
    if isinstance(packed, dict):
        if set(packed) == {"array"}:
            return {of_kind(packed["array"], str, "the name of an array")}
        for value in packed.values():
            found |= arrays_within(value, depth + 1)
    elif isinstance(packed, list):
        for value in packed:
            found |= arrays_within(value, depth + 1)
    return found


def arrays_of_run(meta: Mapping[str, Any], members: Members) -> set[str]:
    """Names of the arrays of a run, whose words and shapes agree with each other."""
    heads = {name: members.head(name) for name in ("time", *STATE, "closed", "anchors", "parameters")}
    time = heads["time"]
    expect(time.kind == "f" and len(time.shape) == 1, "'time'")
    count = time.shape[0]
    for name, like in STATE.items():
        expect(heads[name] == Head("f", (count, *heads[like].shape[1:])) and len(heads[name].shape) == 2, f"{name!r}")
    expect(heads["anchors"].kind == "f" and heads["anchors"].shape[:1] == (count,), "'anchors'")
    expect(len(heads["anchors"].shape) == 2, "'anchors'")
    facts = _facts(meta["facts"], heads)
    expect(heads["closed"].kind in "iu" and heads["closed"].shape == (count, facts), "'closed'")
    if "phase" in members.names:
        heads["phase"] = members.head("phase")
        expect(heads["phase"].kind == "i" and len(heads["phase"].shape) == 2, "'phase'")
        expect(heads["phase"].shape[0] == count, "'phase'")
    width = heads["parameters"].shape
    expect(heads["parameters"].kind == "f" and len(width) == 1, "'parameters'")
    expect(len(_list(meta["parameter_names"], str, "'parameter_names'")) <= width[0], "'parameter_names'")
    wanted = set(heads)
    if "q_rate" in members.names:
        expect(members.head("q_rate") == heads["q"], "'q_rate'")
        wanted.add("q_rate")
    if "beside_jumps" in members.names:
        expect(members.head("beside_jumps") == time, "'beside_jumps'")
        wanted.add("beside_jumps")
    for number, row in enumerate(_list(meta["changes"], int, "'changes'")):
        expect(0 <= row <= count and members.head(f"change {number}") == Head("f", width), "'changes'")
        wanted.add(f"change {number}")
    wanted |= _columns(meta, members, heads, count)
    _events(meta["events"], count)
    _words(meta)
    _printable(meta)
    return wanted | _ledger(meta, members, count) | arrays_within(meta["final"]) | arrays_within(meta["failure"])


def _facts(facts: Any, heads: Mapping[str, Head]) -> int:
    """Number of contacts; the facts name as many coordinates as there are columns."""
    of_kind(facts, dict, "'facts'")
    of_kind(facts["model"], str, "the name of the model")
    coordinates = _pairs(facts["coordinates"], "'coordinates'")
    q = of_kind(facts["coordinate_count"], int, "'coordinate_count'")
    expect((q, len(coordinates) - q) == (heads["q"].shape[1], heads["z"].shape[1]), "'coordinates'")
    for contact in _list(facts["contacts"], dict, "'contacts'"):
        expect({"name", "kind", "unit"} <= set(contact) <= {"name", "kind", "unit", "place"}, "'contacts'")
        expect(all(isinstance(word, str) for word in contact.values()), "'contacts'")
    for segment in _list(facts["segments"], list, "'segments'"):
        expect(len(segment) == 2 and isinstance(segment[0], str), "'segments'")
        _list(segment[1], str, "'segments'")
    _pairs(facts.get("frictions", []), "'frictions'")
    _pairs(facts.get("velocities", []), "'velocities'")
    _list(facts.get("markers", []), str, "'markers'")
    _pairs(facts.get("observations", []), "'observations'")
    anatomy = _pairs(facts.get("anatomy", []), "'anatomy'")
    expect(all(among(part, ANATOMY) for _, part in anatomy), "'anatomy'")
    for pair in _list(facts.get("mirror", []), list, "'mirror'"):
        expect(len(pair) == 2 and isinstance(pair[0], str) and pair[1] in (1.0, -1.0), "'mirror'")
    for mode in _list(facts.get("modes", []), list, "'modes'"):
        expect(len(mode) == 2 and isinstance(mode[0], str), "'modes'")
        _list(mode[1], str, "'modes'")
    for shape in _list(facts.get("shapes", []), dict, "'shapes'"):
        _shape(shape)
    return len(facts["contacts"])


def _shape(shape: Mapping[str, Any]) -> None:
    """Something that pictures show, of the names that there are."""
    expect(set(shape) - {"form"} == {"kind", "name", "contacts", "points", "place", "numbers", "across"}, "'shapes'")
    expect(
        all(isinstance(shape.get(word, ""), str) for word in ("kind", "name", "place", "across", "form")), "'shapes'"
    )
    expect(shape.get("form", "") in ("", *FORMS, *HELD_BY), "'shapes'")
    expect(set(shape["across"]) <= set("xzt"), "'shapes'")
    contacts, points = (_list(shape[word], str, "'shapes'") for word in ("contacts", "points"))
    expect(len(contacts) == len(points), "'shapes'")
    numbers = _list(shape["numbers"], (int, float), "'shapes'")
    expect(len(numbers) == NUMBERS.get(shape["kind"], 0), "'shapes'")


def _columns(meta: Mapping[str, Any], members: Members, heads: Mapping[str, Head], count: int) -> set[str]:
    """Columns beside the state; every name is one of them or a part of the state."""
    wanted = set()
    for number in of_kind(meta["values"], dict, "'values'").values():
        name = f"value {of_kind(number, int, 'values')}"
        if name not in wanted:
            head = members.head(name)
            expect(head.kind in "fiub" and head.shape in ((count,), (1,)), f"{name!r}")
            wanted.add(name)
    for alias in of_kind(meta["aliases"], dict, "'aliases'").values():
        expect(isinstance(alias, list) and len(alias) == 2 and isinstance(alias[0], str), "'aliases'")
        part, place = alias[0], of_kind(alias[1], int, "'aliases'")
        expect(part in (*STATE, "closed", "anchors") and 0 <= place < heads[part].shape[1], "'aliases'")
    names = _list(meta["names"], str, "'names'")
    expect(all(name in meta["values"] or name in meta["aliases"] for name in names), "'names'")
    return wanted


def _ledger(meta: Mapping[str, Any], members: Members, count: int) -> set[str]:
    """Energies, one a row; older files do not tell what stores energy."""
    wanted = {"kinetic", "potential"}
    wanted |= {f"part {k}" for k, _ in enumerate(_pairs(meta["parts"], "'parts'"))}
    wanted |= {f"store {k}" for k, _ in enumerate(_pairs(meta.get("stored", []), "'stored'"))}
    _pairs(meta.get("withheld", []), "'withheld'")
    for name in wanted:
        expect(members.head(name) == Head("f", (count,)), f"{name!r}")
    return wanted


def _events(events: Any, count: int) -> None:
    for event in _list(events, dict, "'events'"):
        expect(event["kind"] in KINDS and isinstance(event["name"], str), "'events'")
        expect(0 <= of_kind(event["row"], int, "'events'") <= count, "'events'")
        impulses = of_kind(event.get("impulses", {}), dict, "'events'")
        impulse_lists = [of_kind(value, list, "'events'") for value in (event["impulse"], *impulses.values())]
        for number in (event["time"], event["energy_loss"], *(number for values in impulse_lists for number in values)):
            of_kind(number, int | float, "'events'")


def _words(meta: Mapping[str, Any]) -> None:
    """Message, settings, counts and the like."""
    of_kind(meta["success"], bool, "'success'")
    of_kind(meta["message"], str, "'message'")
    stats, settings = of_kind(meta["stats"], dict, "'stats'"), of_kind(meta["settings"], dict, "'settings'")
    _list(stats.get("notes", []), str, "'notes'")
    for name, kind in (("integrator", str), ("between", str), ("contact", str), ("versions", dict)):
        of_kind(settings.get(name, kind()), kind, f"{name!r}")
    expect(settings.get("between", HERMITE.name) in EXTENSIONS, "'between'")
    for name in ("dt", "tol"):
        of_kind(settings.get(name) or 0.0, int | float, f"{name!r}")
    expect(of_kind(settings.get("store", 1), int, "'store'") >= 1, "'store'")
    violation = of_kind(meta["violation"], dict, "'violation'")
    of_kind(violation.get("worst", ""), str, "'violation'")
    for name in ("length", "angle", "rate"):
        of_kind(violation.get(name, 0.0), int | float, "'violation'")


def _printable(meta: Mapping[str, Any]) -> None:
    """Names as models have them, without signs that a terminal obeys."""
    facts = meta["facts"]
    names = [facts["model"], *meta["names"], *(name for name, _ in facts["coordinates"]), *facts.get("markers", ())]
    names += [word for shape in facts.get("shapes", ()) for word in (shape["name"], shape["place"] or "-")]
    names += [contact["name"] for contact in facts["contacts"]] + [event["name"] for event in meta["events"]]
    for name in names:
        printable(name, "the file")
