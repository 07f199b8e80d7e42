"""The kernel's functions → LLVM IR text (`mbd.trees.llvm`), its record a table of addresses."""

from collections import Counter
from collections.abc import Sequence

from mbd.kernel.records import TABLE
from mbd.trees import llvm, tree
from mbd.trees.llvm import HEAD

PLACES = {field: place for place, field in enumerate(TABLE.addresses)}
TAGS = {
    what: 2 * place + 3 for place, what in enumerate(("real", "int", *TABLE.real_arrays, *TABLE.integer_arrays, "code"))
}
"""Numbers of LLVM's tags of memory, see `tags`."""
WITHIN_ANOTHER = {"shift1": "block"}
"""Fields that lie in the array of another, whose tag they have."""
TAGS |= {part: TAGS[whole] for part, whole in WITHIN_ANOTHER.items()}


class Body(llvm.Body):
    """One function of the kernel."""

    places = PLACES
    tags = TAGS


def llvm_text(functions: Sequence[tree.Function], entry: str) -> str:
    """The module of some functions, of which the last is called from outside, by the name `entry`.

    What is called in one place only becomes part of its caller at once: LLVM would do the same, but would simplify it
    again at every level of the calls, which takes a third of its time.
    """
    bodies = [Body(function) for function in functions]
    calls = Counter(symbol for body in bodies for symbol in body.called)
    whole = "\n".join([HEAD, tags(), *(body.text(calls[body.function.symbol] == 1) for body in bodies)])
    return whole.replace(f"internal i64 @{functions[-1].symbol}(", f"i64 @{entry}(")


def tags() -> str:
    """What cannot share a place, in LLVM's words: reals and integers, and the arrays of any two fields of the kernel.

    An array that is an argument or a local name may be that of any field of its kind.
    """
    lines = ["!0 = !{}", '!1 = !{!"kernel"}']
    for what, tag in TAGS.items():
        if what in WITHIN_ANOTHER:
            continue
        parent = 1 if what in ("real", "int") else TAGS["real" if what in TABLE.real_arrays else "int"] - 1
        lines += [f'!{tag - 1} = !{{!"{what}", !{parent}}}', f"!{tag} = !{{!{tag - 1}, !{tag - 1}, i64 0}}"]
    return "\n".join(lines)
