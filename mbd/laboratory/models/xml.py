"""XML as a tree whose elements know their lines; entities and document types are refused, nothing is fetched."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import field
from pathlib import Path
from xml.parsers import expat

from mbd.dataclass import dataclass
from mbd.errors import ModelError

DEEPEST, MOST = 200, 500_000
"""Nested elements, and elements in all, of a file that is read."""
MAX_BYTES = 200_000_000
"""Size of a file that is read [bytes]."""


@dataclass
class Element:
    """An element: its name, attributes, text, children and line, in a file."""

    tag: str
    attributes: dict[str, str]
    line: int
    file: str
    text: str = ""
    children: list[Element] = field(default_factory=list)

    def __iter__(self) -> Iterator[Element]:
        return iter(self.children)

    def all(self, tag: str) -> list[Element]:
        """The children of a name."""
        return [child for child in self.children if child.tag == tag]

    def find(self, tag: str) -> Element | None:
        """The first child of a name."""
        return next((child for child in self.children if child.tag == tag), None)

    def get(self, name: str, otherwise: str | None = None) -> str:
        """An attribute; an error that names the element where it is needed and absent."""
        value = self.attributes.get(name, otherwise)
        if value is None:
            raise self.wrong(f"needs the attribute {name!r}")
        return value

    def numbers(self, name: str, count: int, otherwise: tuple[float, ...] | None = None) -> tuple[float, ...]:
        """An attribute of so many numbers."""
        text = self.attributes.get(name)
        if text is None:
            if otherwise is None:
                raise self.wrong(f"needs the attribute {name!r}")
            return otherwise
        return self.parsed(text, count, name)

    def parsed(self, text: str, count: int, name: str) -> tuple[float, ...]:
        """So many finite numbers from a text."""
        try:
            values = tuple(float(part) for part in text.replace("_", "?").split())
        except ValueError:
            values = ()
        if len(values) != count or not all(abs(value) < 1e300 for value in values):
            what = "a number" if count == 1 else f"{count} numbers"
            raise self.wrong(f"{name} must be {what}, got {text.strip()[:60]!r}")
        return values

    def wrong(self, sentence: str) -> ModelError:
        """An error about this element."""
        own = self.attributes.get("name")
        called = f" {own!r}" if own else ""
        return ModelError(f"{self.file}, line {self.line}: <{self.tag}>{called} {sentence}")


def read_xml(path: Path, repaired: list[str] | None = None) -> Element:
    """The root of a file.

    Parameters
    ----------
    repaired : where given, comments that XML forbids ("<!--" or "--" within a comment) are skipped and noted there

    Raises
    ------
    ModelError
        for what is no XML, declares entities or a document type, is nested too deep or too large, with the line.
    """
    try:
        if path.stat().st_size > MAX_BYTES:
            raise ModelError(f"{path.name} is larger than {MAX_BYTES / 1e6:.0f} MB")
        data = path.read_bytes()
    except OSError as error:
        raise ModelError(f"'{path}' cannot be read: {error.strerror or error}") from None
    if repaired is not None:
        data = _without_wrong_comments(data, path.name, repaired)
    parser = expat.ParserCreate()
    parser.buffer_text = True
    stack: list[Element] = []
    roots: list[Element] = []
    count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if len(stack) >= DEEPEST or count > MOST:
            raise ModelError(f"{path.name}, line {parser.CurrentLineNumber}: too many elements, or nested too deep")
        element = Element(tag, attributes, parser.CurrentLineNumber, path.name)
        (stack[-1].children if stack else roots).append(element)
        stack.append(element)

    def end(tag: str) -> None:
        stack.pop()

    def text(data: str) -> None:
        if stack:
            stack[-1].text += data

    def refused(*_: object) -> None:
        raise ModelError(
            f"{path.name}, line {parser.CurrentLineNumber}: document types and entities are not read; remove them"
        )

    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = start, end, text
    parser.StartDoctypeDeclHandler = refused
    parser.EntityDeclHandler = refused
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise ModelError(f"{path.name}, line {error.lineno}: no XML here ({expat.ErrorString(error.code)})") from None
    except (UnicodeError, LookupError, ValueError) as error:
        if isinstance(error, ModelError):
            raise
        raise ModelError(f"{path.name}: its characters cannot be read ({error})") from None
    return roots[0]


def _without_wrong_comments(data: bytes, file: str, repaired: list[str]) -> bytes:
    """The text with blanks in the place of comments that hold "--", up to the first "-->"; lines stay."""

    def blank(found: re.Match[bytes]) -> bytes:
        inner = found.group(1)
        if b"--" not in inner and not inner.endswith(b"-"):
            return found.group()
        line = data.count(b"\n", 0, found.start()) + 1
        repaired.append(f"{file}, line {line}: a comment that XML forbids was skipped")
        return re.sub(rb"[^\r\n]", b" ", found.group())

    return re.sub(rb"<!--(.*?)-->", blank, data, flags=re.DOTALL)
