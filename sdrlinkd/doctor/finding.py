"""Findings: what a check says of what it looked at."""

from enum import StrEnum

import msgspec


class State(StrEnum):
    """Whether what was looked at is as it must be."""

    GOOD = "good"
    BAD = "bad"
    NONE = "not applicable"
    """Not needed by this configuration, or not to be known here."""


class Finding(msgspec.Struct, frozen=True):
    """One line for people: what was looked at, what was found and, where it is bad, what to do."""

    what: str
    state: State
    told: str
    to_do: str = ""


def good(what: str, told: str) -> Finding:
    """A finding that something is as it must be."""
    return Finding(what, State.GOOD, told)


def bad(what: str, told: str, to_do: str) -> Finding:
    """A finding about which a person must do something."""
    return Finding(what, State.BAD, told, to_do)


def none(what: str, told: str) -> Finding:
    """A finding about which nothing is to be done."""
    return Finding(what, State.NONE, told)


def good_if(is_good: bool, what: str, told: str, to_do: str) -> Finding:
    """A good finding, or a bad one that says what to do."""
    return good(what, told) if is_good else bad(what, told, to_do)
