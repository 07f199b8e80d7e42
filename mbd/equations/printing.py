"""The equations of motion in print: text that can be read line by line, or LaTeX."""

import re
from collections.abc import Sequence
from typing import Any

from mbd.equations.cost import operations
from mbd.equations.equations import Equations
from mbd.equations.inputs import Inputs
from mbd.equations.programs import constraint_jacobian, mass_matrix
from mbd.notebook import Text
from mbd.tape.derivatives import live, substitute
from mbd.tape.node import Node
from mbd.tape.printing import listing
from mbd.tape.sympy import raise_to_sympy

MAX_FORMULAS = 300
"""Lines of formulas that a notebook sets; more of them it shows as text."""


class Report(Text):
    """Equations of motion in print. A notebook sets their formulas, or shows the text where these are too many."""

    equations: Equations

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, str]:
        formulas = self._repr_latex_()
        return super()._repr_mimebundle_() if formulas is None else {"text/plain": str(self), "text/latex": formulas}

    def _repr_latex_(self) -> str | None:
        """Formulas for a display, with what their symbols mean; None where they are too many."""
        parts = _parts(self.equations)
        if operations([node for entries in parts.values() for node in entries.values()]) > 4 * MAX_FORMULAS:
            return None
        lines, legend = _formulas(self.equations, parts)
        if len(lines) > MAX_FORMULAS:
            return None
        names = [f"&\\mathrm{{{_escaped(line)}}}" for line in [self.equations.name, *legend]]
        body = " \\\\\n".join([*names, *lines]).replace("<", r"\lt ").replace(">", r"\gt ")  # no tags of a page
        return f"$$\\begin{{aligned}}\n{body}\n\\end{{aligned}}$$"


def report(equations: Equations, latex: bool = False) -> Report:
    """M, f, B and h of ``M(q) a + f(t, q, v) + B(q, t)ᵀ λ = 0``, ``h(q, t) = 0``, with operation counts.

    Parameters
    ----------
    equations : what to print; contacts are printed as rows of B and h, penalty stops by their forces
    latex : LaTeX instead of text
    """
    parts = _parts(equations)
    found = Report(_latex(equations, parts) if latex else _text(equations, parts))
    found.equations = equations
    return found


Parts = dict[str, dict[tuple[str, ...], Node]]
"""Letter → entries by the names of coordinates and rows; zeros are left out."""


def _parts(equations: Equations) -> Parts:
    """The entries at x = 0; M above its diagonal only, since it is symmetric."""
    inputs = Inputs.of(equations)
    here: dict[Node, float] = {x: 0.0 for x in inputs.x}
    rest: dict[Node, float] = {node: 0.0 for node in (*inputs.a, *inputs.s, *inputs.lam)}
    rates = [_plain(name) for name in (*equations.velocity_names, *(state.name for state in equations.states))]
    names = [name.removesuffix(".rate") for name in rates]
    rows = [_plain(f"{row.owner}.{row.part}" if row.part else row.owner) for row in equations.rows]
    M = mass_matrix(equations)
    B = constraint_jacobian(equations, range(len(rows)))
    parts: Parts = {
        "M": {(names[i], names[j]): M[j][i] for i in range(len(M)) for j in range(i, len(M))},
        "f": {(name,): node for name, node in zip(names, substitute(list(equations.balance), rest), strict=True)},
        "B": {(rows[k], names[j]): node for k, line in enumerate(B) for j, node in enumerate(line)},
        "h": {(name,): row.value for name, row in zip(rows, equations.rows, strict=True)},
        "b": {(name,): row.rate for name, row in zip(rows, equations.rows, strict=True) if row.is_velocity},
        "p": {(_plain(c.name),): c.force for c in equations.contacts if c.force is not None}
        | {(_plain(c.name), _plain(part)): force for c in equations.contacts for part, _, force in c.drags},
    }
    still = {**here, **dict.fromkeys(inputs.v, 0.0)}
    for letter, entries in parts.items():
        values = substitute(list(entries.values()), still if letter == "b" else here)
        parts[letter] = {key: node for key, node in zip(entries, values, strict=True) if not node.is_zero}
    return parts


def _plain(name: str) -> str:
    """A name without spaces: 'left hip.angle' → 'left_hip.angle'."""
    return re.sub(r"\s+", "_", name)


def _input_names(equations: Equations) -> dict[Node, str]:
    """Inputs by the names that users know."""
    inputs = Inputs.of(equations)
    names = {inputs.t: "t"}
    names |= dict(zip(inputs.q, (_plain(c.name) for c in equations.coordinates), strict=True))
    names |= dict(zip(inputs.v, (_plain(name) for name in equations.velocity_names), strict=True))
    names |= dict(zip(inputs.z, (_plain(c.name) for c in equations.states), strict=True))
    names |= {equations.tape.input("p", k): _plain(p.name) for k, p in enumerate(equations.parameters)}
    for contact in equations.contacts:
        names |= {equations.tape.input("anchor", k): f"{_plain(contact.name)}.anchor{k}" for k in contact.anchors}
    names |= {equations.tape.input("anchor", t.anchor): f"{_plain(t.joint)}.turns" for t in equations.turns}
    return names


def _counts(parts: Parts) -> str:
    each = ", ".join(f"{letter} {operations(list(entries.values()))}" for letter, entries in parts.items() if entries)
    together = operations([node for entries in parts.values() for node in entries.values()])
    return f"operations: {each}; together {together} after sharing"


def _text(equations: Equations, parts: Parts) -> str:
    """Assignments, one a line."""
    entries = {f"{letter}[{', '.join(key)}]": node for letter, found in parts.items() for key, node in found.items()}
    lines = [
        f"{equations.name}: M(q) a + f(t, q, v) + Bᵀ λ = 0, h(q, t) = 0"
        f"  ({equations.n_v} coordinates, {equations.n_z} states, {len(equations.rows)} rows)",
        "M is symmetric, entries above its diagonal are shown; what is not shown is zero",
    ]
    if parts["p"]:
        lines.append("p are forces of penalty contacts while they act")
    if any(row.is_velocity for row in equations.rows):
        lines.append("rows without h hold velocities: B v + b = 0")
    lines.append(_counts(parts))
    return "\n".join([*lines, "", listing(entries, _input_names(equations))])


# LaTeX --------------------------------------------------------------------------------------------------------------
def _latex(equations: Equations, parts: Parts) -> str:
    """An ``align*`` environment; comments above it say what symbols mean."""
    lines, legend = _formulas(equations, parts)
    body = " \\\\\n".join(lines)
    comments = "\n".join(f"% {line}" for line in [equations.name, _counts(parts), *legend])
    return f"{comments}\n\\begin{{align*}}\n{body}\n\\end{{align*}}"


def _formulas(equations: Equations, parts: Parts) -> tuple[list[str], list[str]]:
    """Lines with & before their equals signs, and what symbols mean."""
    import sympy

    symbols, legend = _symbols(equations)
    places = {name: str(k + 1) for k, name in enumerate(_numbered(equations))}
    named = [(letter, key, node) for letter, found in parts.items() for key, node in found.items()]
    outputs = [node for _, _, node in named]
    # operations up to which LaTeX writes whole formulas; beyond, what is used twice gets a name of its own
    shared = [] if operations(outputs) <= 120 else _shared(outputs)
    lines, known = [], dict(symbols)
    for k, node in enumerate(shared):
        (formula,) = raise_to_sympy([node], known)
        known[node] = sympy.Symbol(f"w_{{{k + 1}}}", real=True)
        lines.append(f"w_{{{k + 1}}} &= {sympy.latex(formula)}")
    for letter, key, node in named:
        (formula,) = raise_to_sympy([node], known)
        index = "\\,".join(places.get(part, f"\\mathrm{{{_spaced(part)}}}") for part in key)
        lines.append(f"{letter}_{{{index}}} &= {sympy.latex(formula)}")
    return lines, legend


def _escaped(name: str) -> str:
    """A name as LaTeX prints it, sign by sign.

    >>> print(_escaped("50 $a_b"))
    50~\\$a\\_b
    """
    return "".join(SIGNS.get(sign, sign) for sign in name)


SIGNS = {
    **{sign: f"\\{sign}" for sign in "#$%&_{}"}, " ": "~", "\\": r"\backslash ", "^": r"\wedge ", "~": r"\sim ",
}  # fmt: skip
"""Signs that mean something to LaTeX, as its formulas print them."""


def _numbered(equations: Equations) -> list[str]:
    """Names of coordinates and states, which are numbered from 1."""
    names = [_plain(name).removesuffix(".rate") for name in equations.velocity_names]
    names += [_plain(state.name) for state in equations.states]
    return names


def _symbols(equations: Equations) -> tuple[dict[Node, Any], list[str]]:
    """q_1, \\dot q_1, … and a symbol for every parameter, with the list of what they mean."""
    import sympy

    inputs, legend = Inputs.of(equations), []
    found: dict[Node, Any] = {inputs.t: sympy.Symbol("t", real=True)}
    for k, (q, coordinate) in enumerate(zip(inputs.q, equations.coordinates, strict=True), start=1):
        own = coordinate.name.isidentifier()
        found[q] = sympy.Symbol(coordinate.name if own else f"q_{{{k}}}", real=True)
        legend.append(f"{'coordinate ' if own else 'q_'}{k} = {coordinate.name} [{coordinate.unit}]")
    for k, (v, name) in enumerate(zip(inputs.v, equations.velocity_names, strict=True), start=1):
        own = name.removesuffix(".rate").isidentifier()
        letter = sympy.latex(sympy.Symbol(name.removesuffix(".rate"))) if own else f"q_{{{k}}}"
        found[v] = sympy.Symbol(f"\\dot{{{letter}}}", real=True)
    for k, (z, state) in enumerate(zip(inputs.z, equations.states, strict=True), start=1):
        found[z] = sympy.Symbol(f"z_{{{k}}}", real=True)
        legend.append(f"z_{k} = {state.name}")
    for k, parameter in enumerate(equations.parameters):
        found[equations.tape.input("p", k)] = sympy.Symbol(_parameter_symbol(parameter.name), real=True)
    return found, legend


LETTERS = {
    "mass": "m", "length": "l", "center": "c", "inertia": "J", "stiffness": "k", "coefficient": "d", "damping": "d",
}  # fmt: skip
"""Letters of common fields; other fields are written out."""


def _parameter_symbol(name: str) -> str:
    """'left thigh.mass' → m with 'left thigh' below it."""
    owner, _, field = name.partition(".")
    if owner == "gravity":
        return f"g_{field}"
    if not field:
        return owner if owner.isidentifier() else f"\\mathrm{{{_spaced(owner)}}}"
    letter = LETTERS.get(field, f"\\mathrm{{{_spaced(field)}}}")
    return f"{letter}_{{\\mathrm{{{_spaced(owner)}}}}}"


def _spaced(name: str) -> str:
    """A name in upright letters, its spaces kept; underscores stand for spaces, see `_plain`."""
    return "~".join(_escaped(word) for word in re.split(r"[\s_]+", name))


def _shared(outputs: Sequence[Node]) -> list[Node]:
    """Operations that are used more than once, in order."""
    uses: dict[int, int] = {}
    order = live(outputs)
    for node in order:
        for arg in node.args:
            uses[arg.index] = uses.get(arg.index, 0) + 1
    for node in outputs:
        uses[node.index] = uses.get(node.index, 0) + 1
    return [node for node in order if node.args and uses[node.index] > 1]
