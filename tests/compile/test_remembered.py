"""Programs that are found by what their equations are: the same to the bit, and found only where they are the same."""

from dataclasses import fields, is_dataclass

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.compile import backend, llvm, mechanism
from mbd.compile.cache import ObjectCache
from mbd.compile.fingerprint import fingerprint
from mbd.compile.ir import Module
from mbd.compile.layout import Layout
from mbd.compile.mechanism import Mechanism
from mbd.equations import programs
from mbd.equations.charts import chart_end, chart_motion
from mbd.equations.derivation import derive
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.testing.mechanisms import random_loop, random_scene, random_tree
from tests.comparisons import at_least, compared
from tests.joints.quaternion_ball import QuaternionBall

SEEDS = st.integers(0, 10**6)


def spatial(seed):
    """A floating body with a ball joint and whatever else follows."""
    model, rng = random_tree(seed, 1, spatial=True), np.random.default_rng(seed)
    float_, arm = (mbd.RigidBody(name, 1.3, (0.3, 0.4, 0.5), center=(0.1, 0.0, 0.2)) for name in ("float", "arm"))
    stiffness = float(rng.choice([0.0, 3.0]))
    ball = mbd.Spherical("ball", float_.point(0.1, -0.2, 0.3), arm.origin, stiffness=stiffness)
    model.connect(mbd.Free("free", model.ground.origin, float_.origin), ball)
    model.constrain(mbd.Unilateral("cone", mbd.cone(ball, 0.8), restitution=0.2))
    return model


KINDS = {
    "tree": lambda seed: random_tree(seed, 2, spatial=bool(seed % 2)),
    "loop": lambda seed: random_loop(seed, 3)[0],
    "loop, all cut": lambda seed: cut_everywhere(random_loop(seed, 3)[0]),
    "scene": lambda seed: random_scene(seed, 2),
    "ball": spatial,
}


def cut_everywhere(model):
    model.cut = "all"
    return model


def texts(equations):
    """The code of everything that a run may ask for of equations just derived, and how its inputs lie."""
    layout, rows = Layout.of(equations), range(len(equations.rows))
    made = {"accelerations": programs.accelerations(equations), "guards": programs.guards(equations)}
    if equations.compose is not None:
        made |= {"compose": programs.compose(equations), "rates": programs.increment_rates(equations)}
        made |= {"chart_end": chart_end(equations), "chart_motion": chart_motion(equations)}
    made |= {"scales": programs.scales(equations), "terms": programs.guard_terms(equations)}
    for stabilized in (True, False):
        mode = programs.ActiveSet(rows, (), stabilized, range(len(equations.frictions)))
        made |= {f"tangent {stabilized}": programs.newton(equations, mode)}
        made |= {f"residual {stabilized}": programs.residual(equations, mode)}
    return Module({name.replace(" ", "_"): nodes for name, nodes in made.items()}, layout).text()


def made(model, cache, modes=2):
    """A mechanism whose code is kept in a cache, with some of its modes."""
    found = Mechanism(derive(model), backend=cache)
    manager = ActiveSetManager(found.equations)
    rows = manager.active_rows(manager.flags(()))
    for ask in (found.stepping, found.mode, found.explicit)[:modes]:
        code = ask(programs.ActiveSet(rows))
        code.tangent(*arrays(found, code.tangent.size))
    return found


def arrays(found, size):
    rng = np.random.default_rng(3)
    return 0.3 + rng.random(found.layout.size + 5000), found.parameters(), np.zeros(size)


def values(found):
    """Bits of all functions at one place."""
    results = {}
    for name in found.common:
        given_ = arrays(found, found.common[name].size)
        found.common[name](*given_)
        results[name] = given_[2].tobytes()
    return results


@pytest.fixture
def store(tmp_path, monkeypatch):
    """A cache of its own, in the place of a backend's name."""
    cache = ObjectCache(tmp_path)
    monkeypatch.setattr(mechanism, "choose_backend", lambda cache: backend.backend("llvm", 0, cache))
    return cache


# the same to the bit ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "seed"), [("tree", 1), ("loop", 2), ("loop, all cut", 1), ("scene", 4), ("ball", 2)])
def test_what_is_remembered_is_what_would_be_made(kind, seed, store, monkeypatch):
    first = made(KINDS[kind](seed), store, 3)
    again = made(KINDS[kind](seed), store, 3)
    assert not any(build.cached for build in first.common.builds[:1]) and all(b.cached for b in again.common.builds)
    assert all(build.text == 0.0 for build in again.common.builds)  # none was written
    assert len(again.equations.tape.nodes) < len(first.equations.tape.nodes)
    assert values(first) == values(again)
    monkeypatch.setattr(mechanism.Remembered, "find", lambda *_: None)
    assert values(made(KINDS[kind](seed), ObjectCache(), 3)) == values(first)
    for key, code in first._modes.items():
        assert np.array_equal(code.order, again._modes[key].order)


@at_least(3)
def test_what_is_missing_is_made_in_its_old_place(store):
    """Of a mode that is not remembered the text is that of a process that remembered nothing."""
    model = KINDS["scene"](4)
    expected = values(made(model, store, 3))
    whole = {path.name: path for path in store.directory.iterdir()}
    for name, path in whole.items():
        if b'"straight"' in (content := path.read_bytes()) or b'"tail"' in content or b'"order"' in content:
            path.unlink()
            compared()
            assert values(made(model, store, 3)) == expected
            assert {path.name for path in store.directory.iterdir()} == set(whole), name


@pytest.mark.parametrize("damage", ["cut", "empty", "another entry", "no json"])
def test_damaged_entries_are_made_again(damage, store):
    model = KINDS["scene"](5)
    expected = values(made(model, store))
    paths = sorted(store.directory.iterdir())
    for path, other in zip(paths, [*paths[1:], paths[0]], strict=True):
        content = path.read_bytes()
        path.write_bytes({"cut": content[:-3], "empty": b"", "another entry": other.read_bytes()}.get(damage, content))
    if damage == "no json":
        for path in paths:
            store.store(path.name.removesuffix(".object"), b"[1, 2") if b'"facts"' in path.read_bytes() else None
    assert values(made(model, store)) == expected
    assert all(build.cached for build in made(model, store).common.builds)


def test_large_programs_that_are_half_optimized_go_on_being_so(store, monkeypatch):
    jobs = []
    monkeypatch.setattr(llvm, "submit", jobs.append)
    monkeypatch.setattr(
        mechanism, "choose_backend",
        lambda cache: backend.Backend("llvm", "", lambda layout: llvm.Library(layout, 2, cache, hasty=0)),
    )  # fmt: skip
    model = KINDS["tree"](3)
    first = made(model, store)
    expected, waiting = values(first), len(jobs)
    assert waiting > 1 and jobs.pop().step() and jobs.clear() is None
    again = made(model, store)
    assert any(again.common[name].provisional for name in again.common) and values(again) == expected
    assert all(build.text == 0.0 for build in again.common.builds)
    for job in jobs:
        while job.step():
            pass
    assert not any(again.common[name].provisional for name in again.common) and values(again) == expected
    jobs.clear()
    third = made(model, store)
    assert not jobs and all(build.cached for build in third.common.builds) and values(third) == expected


# only where they are the same -------------------------------------------------------------------------------------


def numbers(item, path=(), seen=None):
    """Where numbers, truths and texts stand in words: (owner, field)."""
    seen = {} if seen is None else seen
    if id(item) in seen:
        return
    seen[id(item)] = item
    if isinstance(item, list | tuple):
        for part in item:
            yield from numbers(part, path, seen)
    elif is_dataclass(item) and not isinstance(item, type):
        for field in fields(item):
            value = getattr(item, field.name)
            if isinstance(value, float | bool | tuple) and value != ():
                yield item, field.name
            yield from numbers(value, path, seen)


def changed(value, how):
    """A number, or the first one of a tuple, as something else."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, float):
        return {"zero": 0.0, "one": 1.0, "larger": 1.7 * value + 0.1}[how]
    if value and isinstance(value[0], float):
        return (changed(value[0], how), *value[1:])
    return value


def elements(model):
    groups = (model.joints, model.forces, model.constraints)
    return list(numbers([word for group in groups for word in (group.values() if isinstance(group, dict) else group)]))


@at_least(1)
@given(st.sampled_from(sorted(KINDS)), SEEDS, st.integers(0, 10**6), st.sampled_from(["zero", "one", "larger"]))
@settings(max_examples=10)
def test_equal_fingerprints_mean_equal_code(kind, seed, place, how):
    """Whatever field of whatever word is changed: the fingerprint changes, or the code is the same."""
    before = derive(KINDS[kind](seed))
    known, code = fingerprint(before), texts(before)
    model = KINDS[kind](seed)
    places = elements(model)
    owner, field = places[place % len(places)]
    object.__setattr__(owner, field, changed(getattr(owner, field), how))
    try:
        after = derive(model)
    except (mbd.ModelError, mbd.CapabilityError, ValueError, TypeError):
        return
    assert known is not None
    if fingerprint(after) == known:
        compared()
        assert texts(after) == code


@given(st.sampled_from(sorted(KINDS)), SEEDS, SEEDS)
@settings(max_examples=5)
def test_so_they_do_for_other_models_and_the_same_model_has_one(kind, seed, other):
    first, second, third = (derive(KINDS[kind](number)) for number in (seed, seed, other))
    assert fingerprint(first) == fingerprint(second) is not None
    if fingerprint(first) == fingerprint(third):
        assert texts(first) == texts(third)


def pendulum(**words):
    model = mbd.Model("pendulum", tunable=words.pop("tunable", ()))
    rod = mbd.Link("rod", words.pop("mass", 1.2), 0.7, 0.3, 0.05)
    hinge = mbd.Revolute("hinge", model.ground.origin, rod.start, loss=words.pop("loss", None))
    model.connect(hinge)
    if "law" in words:
        model.apply(mbd.Potential("spring", words["law"], "hinge.angle"))
    return model


def test_values_of_parameters_do_not_count_unless_they_are_part_of_the_structure():
    known = fingerprint(derive(pendulum()))
    assert fingerprint(derive(pendulum(mass=3.4))) == known
    for other in (pendulum(mass=1.0), pendulum(loss=mbd.Viscous(0.1))):
        assert fingerprint(derive(other)) != known
    assert fingerprint(derive(pendulum(mass=1.0, tunable=["rod.mass"]))) == known


def test_of_users_functions_the_expressions_count_and_nothing_else():
    def law(stiffness):
        def energy(angle):
            unused = angle**3
            assert unused is not None
            return stiffness * angle * angle

        return energy

    known = fingerprint(derive(pendulum(law=law(2.5))))
    assert fingerprint(derive(pendulum(law=law(2.5)))) == known is not None
    assert fingerprint(derive(pendulum(law=law(2.6)))) != known
    written = [lambda angle: mbd.cos(angle), lambda angle: mbd.cos(angle) * 1.0]
    assert len({fingerprint(derive(pendulum(law=each))) for each in written}) == 1


def test_joints_of_a_users_own_class_have_no_fingerprint_and_run_as_ever(store):
    model = mbd.Model("own joint")
    body = mbd.RigidBody("body", 1.0, (0.2, 0.3, 0.4), center=(0.1, 0.2, 0.3))
    model.connect(QuaternionBall("ball", model.ground.origin, body.origin))
    assert fingerprint(derive(model)) is None
    first, again = made(model, store), made(model, store)
    assert any(build.text > 0.0 for build in again.common.builds) and values(first) == values(again)


def test_nothing_is_asked_where_there_is_no_cache(monkeypatch):
    monkeypatch.setattr(mechanism, "choose_backend", lambda cache: backend.backend("llvm", 0, cache))
    monkeypatch.setattr("mbd.compile.remembered.fingerprint", lambda _: pytest.fail("there is nothing to look in"))
    values(made(pendulum(), ObjectCache()))
