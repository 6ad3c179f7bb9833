"""Findings: the results of checks."""

from enum import StrEnum

import msgspec


class State(StrEnum):
    """Whether the checked item is as it must be."""

    GOOD = "good"
    BAD = "bad"
    NONE = "not applicable"
    """Not needed by this configuration, or impossible to check here."""


class Finding(msgspec.Struct, frozen=True):
    """One line for people: what was checked, what was found and, if bad, what to do."""

    what: str
    state: State
    told: str
    to_do: str = ""


def good(what: str, told: str) -> Finding:
    """A finding that an item is as it must be."""
    return Finding(what, State.GOOD, told)


def bad(what: str, told: str, to_do: str) -> Finding:
    """A finding that requires a person to act."""
    return Finding(what, State.BAD, told, to_do)


def none(what: str, told: str) -> Finding:
    """A finding that requires no action."""
    return Finding(what, State.NONE, told)


def good_if(is_good: bool, what: str, told: str, to_do: str) -> Finding:
    """A good finding, or a bad one that says what to do."""
    return good(what, told) if is_good else bad(what, told, to_do)
