"""The compiled kernel has one namespace: a name that two of its modules give to different things would be a trap."""

from __future__ import annotations

from collections import defaultdict
from importlib import import_module
from types import FunctionType

from mbd.kernel.build import modules


def test_no_two_modules_of_the_kernel_share_a_name():
    owners = defaultdict(set)
    for module in modules():
        source = import_module(module)
        imported = {name for name in vars(import_module("mbd.kernel.codes")) if name.isupper()}
        for name, value in vars(source).items():
            own = isinstance(value, FunctionType) and value.__module__ == source.__name__
            number = name.isupper() and name not in imported and isinstance(value, int | float)
            if own or number:
                owners[name].add((module, value if number else id(value)))
    functions = {name: places for name, places in owners.items() if len({value for _, value in places}) > 1}
    assert not functions
    assert len(owners) > 100
