"""What tests share: the machinery of `mbd.testing` that they use most."""

from mbd.testing.order import SECOND_ORDER, assert_second_order, halved
from mbd.testing.scope import FreeScope, skew

__all__ = ["SECOND_ORDER", "FreeScope", "assert_second_order", "halved", "skew"]
