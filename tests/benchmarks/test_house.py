"""The counts of the source, on a package of four files whose counts can be read off."""

import pytest

pytest.importorskip("benchmarks")

from benchmarks.house import ROOT, House

FILES = {
    "__init__.py": "from house.low.a import f\n",
    "low/a.py": '"""Doc."""\n\nA, B = 0, 1\nLIMIT = -2.0**3  # a bound\nTHREE: int = 3\nON = True\nNAME = ""\n\n\n'
    'def f(a, b, /, c, *, d):\n    """Two\n    lines."""\n    from house.high import g\n\n    return g\n',
    "high.py": "from typing import TYPE_CHECKING\n\nif TYPE_CHECKING:\n    import house.top\nfrom house.low import a\n",
    "top.py": "",
}


@pytest.fixture
def house(tmp_path):
    for name, text in FILES.items():
        file = tmp_path / "house" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    return House(tmp_path / "house")


def test_lines_and_constants_are_counted(house):
    assert (house.lines(), house.code_lines()) == (21, 13)
    assert house.constants() == {"house.low.a": ["LIMIT", "THREE"]}
    assert house.argument_lists() == {"house.low.a.f": 3}


def test_imports_tie_files(house):
    assert house.circles(inside=False) == []
    assert house.circles(inside=True) == [{"house.low.a", "house.high"}]
    assert house.chain() in (["house.high", "house.low.a"], ["house.high", "house.top"])


def test_rooms_of_mbd_stand_in_one_order_few_files_are_tied_and_no_chain_of_imports_is_longer_than_eighteen():
    house = House(ROOT / "mbd")
    assert house.circles(inside=False) == [] and len(house.chain()) <= 18
    assert sum(map(len, house.circles(inside=True))) < 20
