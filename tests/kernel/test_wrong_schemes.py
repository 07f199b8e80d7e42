"""Wrong entries of compiled schemes: each is refused by name, file and line, or breaks the law that it should."""

import sys
from dataclasses import dataclass, replace
from itertools import count
from types import SimpleNamespace
from typing import ClassVar

import pytest

import mbd
from mbd.errors import CapabilityError
from mbd.kernel import build
from mbd.kernel.records import Kernel
from mbd.kernel.schemes import contract
from mbd.kernel.translation.interpreted import InterpretedScheme
from mbd.testing import LawBroken, schemes as kit
from mbd.testing.findings import Findings
from tests.kernel import midpoint
from tests.kernel.midpoint import Midpoint

NUMBERS = count()


def without_step(K: Kernel, t1: float) -> int:
    return 0


def with_swapped_arguments(K: Kernel, t1: float, h: float) -> int:
    return 0


def with_an_int(K: Kernel, h: int, t1: float) -> int:
    return 0


def without_status(K: Kernel, h: float, t1: float) -> None:
    pass


def moves_the_state(K: Kernel, h: float, t1: float) -> int:
    status = midpoint.step(K, h, t1)
    K.q[0] += 1e-12
    return status


def remembers_elsewhere(K: Kernel, h: float, t1: float) -> int:
    """Adds a trace of what the last step left in an array that is not kept."""
    last = K.stages[0]
    status = midpoint.step(K, h, t1)
    K.y1[0] += 1e-9 * last
    K.stages[0] = K.y1[0] + 1.0
    return status


def of_order_one(K: Kernel, h: float, t1: float) -> int:
    status = midpoint.step(K, h, t1)
    K.y1[0] += 5.0 * h * h
    return status


def misspells(K: Kernel, h: float, t1: float) -> int:
    K.failure_tim = t1
    return 0


def begins(K: Kernel) -> int:
    return 7


def resumes(K: Kernel, h: float) -> int:
    return 8


@dataclass(frozen=True)
class Wrong(Midpoint):
    """An integrator that names the entry under test."""

    scheme: ClassVar[str | None] = "wrong"


@pytest.fixture
def listed(monkeypatch):
    """Lists an entry, for runs in Python, which build nothing."""

    def add(**changed):
        entry = replace(midpoint.SCHEME, name="wrong", **changed)
        name = f"wrong_scheme_{next(NUMBERS)}"
        monkeypatch.setitem(sys.modules, name, SimpleNamespace(SCHEME=entry, __file__=__file__))
        monkeypatch.setattr(contract, "SCHEMES", (*contract.SCHEMES, name))

    return add


@pytest.mark.parametrize(
    ("step", "message"),
    [
        (
            without_step,
            r"'wrong': expected a function step\(K, h, t1\) of a module as its 'step', got without_step\(K",
        ),
        (with_swapped_arguments, r"got with_swapped_arguments\(K: .*Kernel, t1: float, h: float\), tests/kernel"),
        (with_an_int, "one whose 'h' is 'int' in place of 'float', tests/kernel/test_wrong_schemes.py:"),
        (without_status, "one whose 'return' is 'None' in place of 'int'"),
        (lambda K, h, t1: 0, "got <function <lambda>"),
        ("step", "got 'step'"),
    ],
    ids=["no step size", "arguments swapped", "an int for a float", "no status", "a lambda", "a text"],
)
def test_a_hook_that_the_kernel_could_not_call_is_refused_as_its_entry_is_made(step, message, monkeypatch):
    monkeypatch.chdir(build.Path(__file__).parents[2])
    with pytest.raises(CapabilityError, match=message):
        replace(midpoint.SCHEME, name="wrong", step=step)


def test_a_field_that_no_record_declares_is_an_error_in_python_too(listed):
    listed(step=misspells)
    place = r"test_wrong_schemes.py:\d+, in misspells: 'K.failure_tim = t1': "
    with pytest.raises(CapabilityError, match=place + "no field of the kernel named 'failure_tim'; did you mean"):
        kit.tree().run(Wrong(), dt=0.05, backend="python")
    with pytest.raises(AttributeError, match="no field of the kernel named 'n_row'"):
        Kernel(n_row=1)
    with pytest.raises(AttributeError, match="no field of the kernel named 'n_row'; did you mean 'n_rows'"):
        _ = Kernel(n_rows=1).n_row


def test_a_number_that_the_kernel_does_not_have_is_refused(listed, monkeypatch):
    listed()
    monkeypatch.setattr(Wrong, "numbers", lambda self: {"bta": 0.3})
    with pytest.raises(CapabilityError, match=r"gives numbers\(\) for 'bta': .*did you mean 'beta'"):
        kit.tree().run(Wrong(), dt=0.05, backend="python")


def test_memory_that_an_entry_does_not_ask_for_is_named_as_the_kernel_is_built(listed):
    listed(memory=lambda K: {"tableau": 3})
    with pytest.raises(CapabilityError, match=r"'wrong': its step uses K.stages, .*try memory=lambda K: {'stages'"):
        build.kernel_functions()


@pytest.mark.parametrize("length", [0, 2])
def test_memory_that_is_too_short_is_named_in_python(listed, length):
    listed(memory=lambda K: {"stages": length} if length else {})
    with pytest.raises(CapabilityError, match=rf"midpoint.py:\d+, in step: 'K.stages.* is (stages: {length}|none)"):
        kit.tree().run(Wrong(), dt=0.05, backend="python")


def test_more_coefficients_than_memory_are_refused(listed):
    listed(coefficients=lambda: {"tableau": [1.0, 2.0]})
    with pytest.raises(CapabilityError, match="has 2 coefficients for 'tableau', .* a length of 0; try 2 or more"):
        kit.tree().run(Wrong(), dt=0.05, backend="python")


@pytest.mark.parametrize(
    ("step", "law"),
    [
        (moves_the_state, "transaction: a step leaves the accepted state"),
        (remembers_elsewhere, "determinism: a step taken again gives the same bits"),
        (of_order_one, "order as promised: within 0.15"),
    ],
)
def test_a_step_breaks_the_law_that_it_should(listed, step, law, monkeypatch):
    listed(step=step)
    findings, run = Findings("wrong"), kit.Scene.run
    monkeypatch.setattr(kit, "MORE_HALVINGS", 0)
    monkeypatch.setattr(kit.Scene, "run", lambda *given, **how: run(*given, **how, backend="python"))
    monkeypatch.setattr(
        kit.Scene, "reference", lambda scene, high: run(scene, mbd.RungeKutta853(), dt=0.05, backend="python")
    )
    kit._in_python(findings, Wrong(), kit.tree())
    kit._orders(findings, Wrong(), kit.tree(), 0.05, 1)
    with pytest.raises(LawBroken) as caught:
        findings.verdict()
    assert law in caught.value.laws


@pytest.mark.parametrize("own", [False, True])
def test_a_scheme_without_a_resume_starts_from_the_rates_that_are_there(listed, own):
    """Beyond a singular configuration, in machine code and in Python."""
    listed(start=begins, resume=resumes if own else None)
    text, names = contract.dispatch()
    exec(text, names := {**names, "Kernel": Kernel})
    for resume in (names["scheme_resume"], InterpretedScheme(contract.scheme_named("wrong")).resume):
        K = Kernel(n=2, n_rows=1, scheme=contract.number_of("wrong"), jump=[3.0, 4.0], impulse=[5.0])
        K.rate, K.lam = [0.0, 0.0], [0.0]
        assert resume(K, 0.1) == (8 if own else 7)
        assert (K.rate, K.lam) == (([0.0, 0.0], [0.0]) if own else ([3.0, 4.0], [5.0]))
