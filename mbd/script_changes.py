"""Settings of the command line put into a script that simulates by itself, before it runs.

Only the text is looked at: a script with one call of `simulate` that runs once gets the settings in that call; one of
which the text already tells that they cannot be applied is refused before anything is computed.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from typing import Any

from mbd.errors import ModelError

__all__ = ["changed"]

DESCRIBES = {"model", "start", "until"}
"""Names of a script that ``mbd run`` simulates itself, with any settings."""

REPEATED = (ast.For, ast.While, ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
LATER = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)

BY_PLACE = ("model", "start", "integrator", "dt", "tol")
"""Arguments of `simulate` that may be given by place."""


def changed(text: str, name: str, changes: Mapping[str, Any]) -> ast.Module | None:
    """The script with the changes in its call of `simulate`; None where they are for ``mbd run`` to apply.

    Parameters
    ----------
    text, name : the script, and its name in errors
    changes : dt or tol, until, parameters by name

    Raises
    ------
    ModelError
        where the text tells that the changes cannot be applied: a `main` without such an argument, several calls.
    """
    tree = ast.parse(text, name)
    asked = ", ".join(changes)
    main = next((each for each in tree.body if isinstance(each, ast.FunctionDef) and each.name == "main"), None)
    if main is not None:
        takes = {each.arg for each in (*main.args.posonlyargs, *main.args.args, *main.args.kwonlyargs)}
        missing = [change for change in changes if change not in takes]
        if missing and main.args.kwarg is None:
            listed = ", ".join(missing)
            raise ModelError(
                f"{name} runs its own main(), so {listed} must be changed in the script; nothing was run; "
                f"or give main the argument{'s' * (len(missing) > 1)} {listed}"
            )
        return None
    defined = {each.id for each in ast.walk(tree) if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store)}
    calls = list(_calls(tree, False))
    if not calls or defined >= DESCRIBES:
        return None
    call, repeated = calls[0]
    if len(calls) > 1 or repeated:
        several = "in a loop" if repeated else f"{len(calls)} times"
        raise ModelError(
            f"{name} simulates by itself, {several}, so {asked} must be changed in the script; nothing was run"
        )
    _put(call, changes)
    return ast.fix_missing_locations(tree)


def _calls(node: ast.AST, repeated: bool) -> Iterator[tuple[ast.Call, bool]]:
    """Calls of `simulate` that run as the script does, and whether they run again and again."""
    if isinstance(node, LATER) or (isinstance(node, ast.If) and "__main__" in ast.unparse(node.test)):
        return
    if isinstance(node, ast.Call) and "simulate" in (getattr(node.func, "attr", ""), getattr(node.func, "id", "")):
        yield node, repeated
    for part in ast.iter_child_nodes(node):
        yield from _calls(part, repeated or isinstance(node, REPEATED))


def _put(call: ast.Call, changes: Mapping[str, Any]) -> None:
    """Give a call other arguments; dt and tol replace each other, parameters are added to those that it has."""
    for place, value in list(enumerate(call.args))[3:]:
        call.keywords.append(ast.keyword(BY_PLACE[place], value))
    del call.args[3:]
    given = {each.arg: each for each in call.keywords}
    for change, value in changes.items():
        new = ast.parse(repr(value), mode="eval").body
        if change == "parameters" and "parameters" in given:
            own = ast.BoolOp(ast.Or(), [given["parameters"].value, ast.Dict([], [])])
            new = ast.Dict([None, None], [own, new])
        given[change] = ast.keyword(change, new)
    for one, other in (("dt", "tol"), ("tol", "dt")):
        if one in changes and other not in changes:
            given.pop(other, None)
    call.keywords = list(given.values())
