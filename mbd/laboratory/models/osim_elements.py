"""What elements of an ``.osim`` file say: texts, numbers, flags, sets, names."""

from typing import Any

from mbd.laboratory.models.xml import Element


def objects_in(owner: Element, tag: str) -> list[Element]:
    """The elements of a set."""
    inside = owner.find(tag)
    objects = inside.find("objects") if inside else None
    return list(objects) if objects else []


def plain(name: str) -> str:
    return " ".join(name.replace(".", "_").split())


def unlike(name: str, taken: set[str], behind: str = " again") -> str:
    """A name that is not taken yet, which then is."""
    while name in taken:
        name += behind
    taken.add(name)
    return name


def text_of(owner: Element, tag: str, otherwise: str | None = None) -> str:
    child = owner.find(tag)
    text = child.text.strip() if child is not None else ""
    if not text and otherwise is None:
        raise owner.wrong(f"needs <{tag}>")
    return text or str(otherwise)


def numbers_of(owner: Element, tag: str, count: int, otherwise: tuple[float, ...] | None = None) -> Any:
    child = owner.find(tag)
    if child is None:
        if otherwise is None:
            raise owner.wrong(f"needs <{tag}>")
        return otherwise
    return child.parsed(child.text, count, tag)


def number_of(owner: Element, tag: str, otherwise: float | None = None) -> float:
    (value,) = numbers_of(owner, tag, 1, None if otherwise is None else (otherwise,))
    return float(value)


def flag_of(owner: Element, tag: str, otherwise: bool = False) -> bool:
    child = owner.find(tag)
    if child is None:
        return otherwise
    text = child.text.strip().lower()
    if text not in ("true", "false", "1", "0"):
        raise child.wrong(f"must be true or false, got {child.text.strip()[:60]!r}")
    return text in ("true", "1")
