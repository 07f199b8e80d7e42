"""A module of IR text in pieces that are compiled one at a time, into object files that belong together.

`ir` writes one function after the other and cuts large ones into parts, each of which is made into machine code for
itself; so it does not matter to a bit of the results in which object file it lies. A piece takes some 50 ms to compile,
which is the longest that anybody has to wait for whoever compiles them in the background.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

__all__ = ["SIZE", "pieces"]

SIZE = 2500
"""Lines of text after which a piece is full: some 1000 operations, with what goes in and out of their functions."""

_SYMBOL = re.compile(r"@([\w.]+)\(")
_PART = "ptr noalias %work) #1 {"
"""How the head of a part of a function ends."""


def pieces(text: str, size: int = SIZE) -> list[str]:
    """Texts of modules that together define what a text of `ir.module` does; parts of functions see each other."""
    common, blocks = _blocks(text.split("\n"))
    helpers = {symbol: block for symbol, block in blocks.items() if _is_helper(block)}
    portions = list(_portions({symbol: block for symbol, block in blocks.items() if symbol not in helpers}, size))
    if len(portions) == 1:
        return [text]
    parts = {symbol for portion in portions for symbol in portion}
    return [_piece(portion, parts, helpers, common) for portion in portions]


def _blocks(lines: list[str]) -> tuple[list[str], dict[str, list[str]]]:
    """Lines outside of functions, and the functions by symbol."""
    common: list[str] = []
    blocks: dict[str, list[str]] = {}
    block = common
    for line in lines:
        if line.startswith("define "):
            found = _SYMBOL.search(line)
            assert found is not None, line
            block = blocks[found[1]] = []
        block.append(line)
        if line == "}":
            block = common
    return common, blocks


def _is_helper(block: list[str]) -> bool:
    """Whether a function serves several others, as the sine does: every piece gets its own."""
    return block[0].startswith("define internal") and _PART not in block[0]


def _portions(blocks: dict[str, list[str]], size: int) -> Iterator[dict[str, list[str]]]:
    portion: dict[str, list[str]] = {}
    filled = 0
    for symbol, block in blocks.items():
        if filled and filled + len(block) > size:
            yield portion
            portion, filled = {}, 0
        portion[symbol] = block
        filled += len(block)
    yield portion


def _piece(portion: dict[str, list[str]], parts: set[str], helpers: dict[str, list[str]], common: list[str]) -> str:
    body = [line for block in portion.values() for line in (_seen(block[0]), *block[1:])]
    called = {symbol for line in body if "call " in line for symbol in _SYMBOL.findall(line)}
    lines = list(body)
    for symbol, block in helpers.items():
        if symbol in called:
            lines += block
    lines += (f"declare void @{symbol}(ptr, ptr, ptr, ptr)" for symbol in sorted(called & parts - set(portion)))
    return "\n".join([*lines, *common])


def _seen(head: str) -> str:
    """The head of a function that other object files may call."""
    return head.replace("define internal ", "define ", 1)
