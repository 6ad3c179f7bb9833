"""Finds this robot's id: configured, or read from names (paper section 4.3)."""

import re
from collections.abc import Iterable

from sdrlinkd.config.schema import Config
from sdrlinkd.errors import ConfigError

MOST = 254
"""Largest id of a robot; 255 is the broadcast address."""
MOST_LISTED = 4
_DIGITS = re.compile(r"[0-9]+")
_ALLOWED = f"robot_id from 0 to {MOST}"


def robot_id(config: Config, topics: Iterable[str]) -> int:
    """This robot's id as configured; with −1, the rightmost run of digits in the namespace.

    Without a namespace, it is the last number in the names of `topics`, the topics taken from the
    bus; all names that contain digits must agree. Raises ConfigError.
    """
    if config.robot_id >= 0:
        return config.robot_id
    where = "robot_id: got -1"
    if config.namespace:
        return _from_namespace(config.namespace, where)
    found = {name: number for name in topics if (number := _last_number(name))}
    numbers = set(found.values())
    if len(numbers) > 1:
        raise ConfigError(
            f'{where}, and namespace is "", so it is the last number in the topics\' names, but '
            f"they disagree: {_listed(found)}; allowed: {_ALLOWED}, a namespace, or topics with "
            "one robot's names"
        )
    number = numbers.pop() if numbers else ""
    if _fits(number):
        return int(number)
    problem = f"is {_listed(found)}, above {MOST}" if found else "is missing: no name has digits"
    raise ConfigError(
        f'{where}, and namespace is "", so it is the last number in the topics\' names, but it '
        f'{problem}; allowed: {_ALLOWED}, or a namespace such as "robot_1"'
    )


def _from_namespace(namespace: str, where: str) -> int:
    number = _last_number(namespace)
    if _fits(number):
        return int(number)
    problem = f"is {_short(number)}, above {MOST}" if number else "is missing"
    raise ConfigError(
        f'{where} (the last number in the namespace), but in "{_short(namespace)}" it {problem}; '
        f'allowed: {_ALLOWED}, or a namespace such as "robot_1"'
    )


def _last_number(name: str) -> str:
    """The rightmost run of digits in `name`, without leading zeros; empty if there is none."""
    runs = _DIGITS.findall(name)
    return (runs[-1].lstrip("0") or "0") if runs else ""


def _fits(number: str) -> bool:
    return bool(number) and len(number) <= len(str(MOST)) and int(number) <= MOST


def _listed(found: dict[str, str]) -> str:
    """The numbers found, each with one name that contains it, for an error message."""
    names = {number: name for name, number in reversed(found.items())}
    told = [f"{_short(number)} in {name}" for number, name in reversed(names.items())]
    more = len(told) - MOST_LISTED
    return ", ".join(told[:MOST_LISTED]) + (f" and {more} more" if more > 0 else "")


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:57] + "..."
