"""What may not be changed, or is not there: refused in words, with what was probably meant."""

from __future__ import annotations

import dataclasses
import difflib
import functools
import json
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NoReturn, SupportsIndex, TypeVar

from . import _core
from ._error import SupineError

Class = TypeVar("Class", bound=type)


def hint(name: str, known: Iterable[str]) -> str:
    """Which of some known names was probably meant, as the end of a message."""
    near = difflib.get_close_matches(name, list(known), 1)
    return f": did you mean `{near[0]}`?" if near else ""


@functools.cache
def case_keys() -> frozenset[str]:
    """The keys of a case, and the names of its tables."""
    return frozenset(row["key"].partition(".")[0] for row in json.loads(_core.parameters()))


def unfit(key: str, reason: str) -> SupineError:
    """A value that no case can have, as the command line tells of one."""
    return SupineError(f"`{key}`: {reason}", "case-value", "input", 1, {"key": key}, None)


def check_keywords(given: Iterable[str], own: Iterable[str]) -> None:
    """Refuses a slip in one of a function's own keywords: those who know the keys of a case would take it for one of these.

    Raises:
        SupineError: with the keyword that was probably meant.
    """
    own, keys = list(own), case_keys()
    for name in given:
        meant = hint(name, [*own, *keys])
        if name not in keys and any(f"`{one}`" in meant for one in own):
            raise SupineError(f"unknown key `{name}`{meant}", "case-key-unknown", "input", 1, {}, None)


def no_attribute(name: str, settable: Iterable[str], shown: Iterable[str]) -> AttributeError:
    """Why an attribute of a session cannot be set."""
    keys = case_keys()
    if name in keys:
        return AttributeError(f"`{name}` is a value of the case: change it by session.set({name}=...)")
    if name in shown:
        return AttributeError(f"`{name}` belongs to every session and cannot be set")
    meant = hint(name, keys.union(one for one in settable if not one.startswith("_")))
    how = "; values of the case are changed by session.set(...)" if any(f"`{key}`" in meant for key in keys) else ""
    return AttributeError(f"a session has no attribute `{name}` to be set{meant}{how}")


class Case(dict[str, Any]):
    """The values of a case, to be looked at: a change here would change no session, so that it is refused.

    A copy (`copy.deepcopy`, `pickle`) is a plain `dict` of one's own.
    """

    if not TYPE_CHECKING:  # Types have it that a dict can be changed.

        def _refuse(self, *_: object, **__: object) -> NoReturn:
            raise TypeError(
                "the values of a case are changed by session.set(...), such as session.set(table={'ap': 3.0}); for a dict of "
                "your own copy this one: copy.deepcopy(session.case)"
            )

        __setitem__ = __delitem__ = __ior__ = _refuse
        clear = pop = popitem = setdefault = update = _refuse

        def __getattr__(self, name: str) -> NoReturn:
            meant = f"case[{name!r}]" if name in self else f"case[key]{hint(name, self)}"
            raise AttributeError(f"a case is a dict without the attribute `{name}`: write {meant}")

        def __setattr__(self, name: str, _: object) -> None:
            self._refuse() if name in self else self.__getattr__(name)

    def __reduce_ex__(self, _: SupportsIndex) -> tuple[type[dict[str, Any]], tuple[dict[str, Any]]]:
        return (dict, (dict(self),))


def in_words(cls: Class) -> Class:
    """A frozen dataclass that says how another of it is made, and what was meant, where somebody sets an attribute."""
    name, fields = cls.__name__, list(getattr(cls, "__dataclass_fields__"))

    def refuse(_: object, attribute: str, value: object = None) -> NoReturn:
        if attribute in fields:
            why = f"cannot be changed: make another, dataclasses.replace(it, {attribute}=...)"
        else:
            why = f"has no attribute `{attribute}`{hint(attribute, fields)}"
        raise dataclasses.FrozenInstanceError(f"a {name} {why}")

    setattr(cls, "__setattr__", refuse)
    setattr(cls, "__delattr__", refuse)
    return cls
