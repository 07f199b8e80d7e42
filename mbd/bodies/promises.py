"""What classes of users' own promise: methods that can be called as their base calls them, and that answer as it does.

A method is compared with the one of the library that it stands for: with the arguments of that one it must be callable.
What is asked of a word without arguments, its parameters, is looked at as the word is taken up.
"""

import inspect
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property, lru_cache
from typing import Any

from mbd.bodies.domains import Domain
from mbd.bodies.values import is_number, named_number_faults, shown
from mbd.errors import MbdError, ModelError
from mbd.tape.node import Node, Scalar


def promise_faults(word: object) -> list[str]:
    """What a word, and the measures and losses that it holds, break of the promises of their bases, a sentence each."""
    fields = getattr(word, "__dict__", {})
    several: list[Any] = [word]
    for value in fields.values():
        if type(value) in (float, int, str, tuple, bool, type(None)):  # asking for a Mapping takes longer
            continue
        several += value.values() if isinstance(value, Mapping) else [value]
    return [fault for each in several if _is_of_a_user(each.__class__) for fault in _faults(each, word)]


def title_of(word: object) -> str:
    """A word with its class: ``'filter' (Lag)``."""
    kind = type(word).__name__
    return f"'{word.name}' ({kind})" if hasattr(word, "name") else kind


def place_of(function: Any) -> str:
    """Where a function stands: `` at walk.py:12``; nothing where that is not known."""
    code = getattr(inspect.unwrap(function), "__code__", None)
    return "" if code is None else f" at {code.co_filename}:{code.co_firstlineno}"


def not_callable_with(function: Any, arguments: Iterable[Any], named: Iterable[str] = ()) -> str:
    """Why a function cannot be called with that many arguments; '' where it can, or where that is not known."""
    try:
        inspect.signature(function).bind(*arguments, **dict.fromkeys(named))
    except TypeError as error:
        return str(error)
    except ValueError:  # builtins without a signature
        pass
    return ""


def function_of(function: Any, what: str, *arguments: str) -> Any:
    """A user's function that can be called with arguments of these names.

    Raises
    ------
    ModelError
        where it cannot: how it is called, where it stands, and what to write.
    """
    why = not_callable_with(function, arguments)
    if why:
        call = f"({', '.join(arguments)})"
        name = getattr(function, "__name__", "update")
        write = f"lambda {', '.join(arguments)}: …" if name == "<lambda>" else f"def {name}{call}"
        raise ModelError(
            f"{what}: {_written(function)} is called with {call}, which it cannot take ({why}); write {write}"
        )
    return function


def _written(function: Any) -> str:
    """A function as it is written, and where."""
    return f"{getattr(function, '__name__', type(function).__name__)}{inspect.signature(function)}{place_of(function)}"


def called(word: Any, method: str, call: str, *arguments: Any) -> Any:
    """What a method of a word answers; what the code of a user's class raises becomes an error that says where.

    Parameters
    ----------
    call : how messages name it, such as 'act(scope)'

    Raises
    ------
    ModelError
        in place of all that is no error of the library.
    """
    function = getattr(word, method)
    if _is_ours(type(word).__module__):
        return function(*arguments)
    try:
        return function(*arguments)
    except MbdError:
        raise
    except Exception as error:  # the user's code may raise anything
        raise ModelError(
            f"{title_of(word)}: {call}{place_of(function)} raised {type(error).__name__}{_line(error)}: {error}"
        ) from error


def scalar(word: Any, method: str, call: str, *arguments: Any) -> Scalar:
    """`called` where one scalar is expected."""
    answer = called(word, method, call, *arguments)
    if isinstance(answer, Node) or is_number(answer):
        return answer  # type: ignore[no-any-return]
    missing = "; is a 'return' missing?" if answer is None else ""
    where = place_of(getattr(word, method))
    raise ModelError(f"{title_of(word)}: {call}{where} must return one number, got {shown(answer)}{missing}")


def line_of_user() -> str:
    """The line of code outside the library that called into it just now; nothing where there is none."""
    frame = inspect.currentframe()
    while frame is not None and _is_ours(frame.f_globals.get("__name__", "")):
        frame = frame.f_back
    return "" if frame is None else f" at {frame.f_code.co_filename}:{frame.f_lineno}"


def _line(error: Exception) -> str:
    """The last line of code outside the library that an error has passed."""
    found, step = "", error.__traceback__
    while step is not None:
        if not _is_ours(step.tb_frame.f_globals.get("__name__", "")):
            found = f" at {step.tb_frame.f_code.co_filename}:{step.tb_lineno}"
        step = step.tb_next
    return found


def _is_ours(module: str) -> bool:
    return module == "mbd" or module.startswith("mbd.")


@lru_cache
def _is_of_a_user(kind: type) -> bool:
    """Whether a class was not written here, but stands for one that was."""
    return not _is_ours(kind.__module__) and any(_is_ours(base.__module__) for base in kind.__mro__)


def _faults(word: Any, holder: object) -> Iterator[str]:
    title = title_of(word) if word is holder else f"{title_of(holder)}, its {type(word).__name__}"
    found = [f"{title}: {fault}" for fault in _broken(type(word))]
    yield from found or (f"{title}: {fault}" for fault in _answer_faults(word))


def _broken(kind: type) -> list[str]:
    """What the methods of a class break of the promises of its bases in the library."""
    found: dict[str, str] = {}
    for owner in kind.__mro__:
        if _is_ours(owner.__module__):
            continue
        for name, own in vars(owner).items():
            promise = next((vars(b)[name] for b in kind.__mro__ if _is_ours(b.__module__) and name in vars(b)), None)
            if promise is not None and not name.startswith("_") and name not in found:
                found[name] = _difference(name, promise, own)
    return [fault for fault in found.values() if fault]


def _difference(name: str, promise: Any, own: Any) -> str:
    """What is wrong with an attribute of a user's class that stands for one of the library."""
    if isinstance(promise, property | cached_property):
        if not inspect.isfunction(own):
            return ""
        return f"{name}{place_of(own)} is a method, and is read without a call; write @property above its def"
    if not inspect.isfunction(promise):
        return ""
    taken = list(inspect.signature(promise).parameters.values())
    if any(each.kind is each.VAR_POSITIONAL for each in taken):
        return ""
    needed = [each for each in taken[1:] if each.default is each.empty]  # the others may be left out by either side
    given = [each.name for each in needed if each.kind is not each.KEYWORD_ONLY]
    named = [each.name for each in needed if each.kind is each.KEYWORD_ONLY]
    call, wanted = f"{name}({', '.join(given)})", f"def {name}({', '.join(['self', *given, *named])})"
    if isinstance(own, property | cached_property):
        return f"{name} is a property, and is called as {call}; write {wanted} without @property"
    if not callable(own) and not hasattr(own, "__get__"):
        return f"{name} is {shown(own)}, and is called as {call}; write {wanted}"
    static = isinstance(own, staticmethod)
    function = own.__func__ if isinstance(own, staticmethod | classmethod) else own
    if not inspect.isfunction(function):
        return ""
    why = not_callable_with(function, given if static else ["self", *given], named)
    return f"{_written(function)} is called as {call}, which it cannot take ({why}); write {wanted}" if why else ""


def _answer_faults(word: Any) -> Iterator[str]:
    """What a word answers wrongly where it is asked without arguments."""
    for name, judged in (("parameters", _numbers), ("fields", _numbers), ("domains", _domains), ("mentions", _several)):
        method = getattr(word, name, None)
        if method is None or not_callable_with(method, ()):  # such as those of a loss, which need its owner
            continue
        fault = judged(called(word, name, f"{name}()"))
        if fault:
            yield f"{name}(){place_of(method)} {fault}"


def _numbers(answer: Any) -> str:
    """What is wrong with parameters by name."""
    if not isinstance(answer, Mapping):
        example = {"knee spring.stiffness": 20.0}
        return f"must return a mapping from names to numbers, such as {example}, got {shown(answer)}"
    faults = named_number_faults(answer, "its answer")
    return "; ".join(faults)


def _domains(answer: Any) -> str:
    """What is wrong with domains of parameters by name."""
    if isinstance(answer, Mapping) and all(isinstance(domain, Domain) for domain in answer.values()):
        return ""
    return f"must return a mapping from names of parameters to mbd.Domain, got {shown(answer)}"


def _several(answer: Any) -> str:
    """What is wrong with what a word says that it refers to."""
    if isinstance(answer, Iterable) and not isinstance(answer, str | Mapping):
        return ""
    return f"must return a list of the frames, joints and names that it refers to, got {shown(answer)}"
