"""Retired words do not return: code, errors, notes and docs speak the language of docs/glossary.md."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FILES = sorted([*(ROOT / "mbd").rglob("*.py"), *(ROOT / "docs").glob("*.md"), ROOT / "README.md"])

RETIRED = {
    r"rows? los(e|es|t) rank|lost rank": "singular configuration, or: the constraint Jacobian loses rank",
    r"straddl\w*|\bastride\b|ASTRIDE": "singular stages, singular-step size",
    r"leftovers?\b": "pivoted Gram norms",
    r"\bblows?\b(?! (up|stiff)|-up)": "impact",
    r"lets_go|share_out|take_over\b|\bborne\b": "release, minimum-norm multipliers, accept for restart, given rows",
    r"\banew\b": "again, or: restarted",
    r"\bSurroundings\b|\bViews\b": "DerivationContext, KinematicProxies",
    r"\b(is|are|was|were) told\b(?! (apart|from|to|otherwise|which|how)\b)": "is reported",
    r"STIRRED|HUSHED|\bstirred\b": "excited, at rest",
    r"\bjammed\b": "Painlevé contact",
    r"\bforet(old|ell)": "predicted, expected",
    r"\bcareful\b|n_careful": "singular steps",
    r"\b_(told|asked|settle|looks)\b|\basked\(|\bblow_": "what it gives; call_user; impact",
}


@pytest.mark.parametrize("retired", RETIRED)
def test_retired_words_do_not_return(retired):
    pattern = re.compile(retired)
    found = [
        f"{file.relative_to(ROOT)}:{number}: {line.strip()[:100]}"
        for file in FILES
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), start=1)
        if pattern.search(line)
    ]
    assert not found, f"say instead: {RETIRED[retired]}\n" + "\n".join(found)


VAGUE = {"told", "said", "interior", "ring"}
"""Names of variables and attributes that do not say what they hold; texts are `text`, what reports is `report`, …"""


def test_variables_are_named_for_what_they_hold():
    files = [file for file in FILES if file.suffix == ".py" and "kernel" not in file.parts]
    found = []
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
                name = node.id if isinstance(node, ast.Name) else node.attr
            else:
                name = getattr(node, "arg", None) if isinstance(node, ast.arg) else getattr(node, "name", None)
            if name in VAGUE:
                found.append(f"{file.relative_to(ROOT)}:{node.lineno}: {name}")
    assert not found, "\n".join(found)
