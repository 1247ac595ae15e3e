"""Modules that are imported when something of them is used, so that hints of types need none of them beforehand."""

from __future__ import annotations

import importlib
from typing import Any


class Late:
    """A module by its name. `Any` stands for whatever is in it where it is not installed."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, name: str) -> Any:
        # Those who look through modules ask for such names; nothing is imported for them.
        if name.startswith("__"):
            raise AttributeError(name)
        try:
            module = importlib.import_module(self._name)
        except ImportError:
            return Any
        return getattr(module, name)
