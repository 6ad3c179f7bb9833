"""Message types by name: their classes, least sizes, and whether they begin with a header."""

import importlib
import importlib.util
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

_SIZES = {
    "boolean": 1, "octet": 1, "byte": 1, "char": 1, "uint8": 1, "int8": 1, "uint16": 2, "int16": 2,
    "wchar": 2, "uint32": 4, "int32": 4, "float": 4, "uint64": 8, "int64": 8, "double": 8,
    "long double": 16,
}  # fmt: skip
MOST_ALIGNED = 8
ENCAPSULATION = 4
_LENGTH = 4
FOLDERS = ("msg", "srv", "action")
_NAME = re.compile(r"([a-z][a-z0-9_]*)/(msg|srv|action)/([A-Z][A-Za-z0-9_]*)")
# The types that make an action, by the end of their names.
_PARTS: dict[str, Callable[[Any], Any]] = {
    "Goal": lambda action: action.Goal,
    "Result": lambda action: action.Result,
    "Feedback": lambda action: action.Feedback,
    "FeedbackMessage": lambda action: action.Impl.FeedbackMessage,
    "SendGoal": lambda action: action.Impl.SendGoalService,
    "GetResult": lambda action: action.Impl.GetResultService,
}
_ARRAY = re.compile(r"(.+)\[(\d+)\]")
_TEXT = re.compile(r"w?string(<\d+>)?")


class UnknownTypeError(Exception):
    """A message type that is not installed here; the message says what to install."""


class Kind(NamedTuple):
    """A message type: `least` is the smallest size of its CDR in octets."""

    name: str
    message: Any
    least: int
    has_header: bool


class ServiceKind(NamedTuple):
    """A service type; `least_request` and `least_response` are the smallest sizes of their CDR."""

    name: str
    service: Any
    least_request: int
    least_response: int


Fields = dict[str, str]


@cache
def kind(name: str) -> Kind:
    """The type called `pkg/msg/Name`. Raises UnknownTypeError."""
    message = _load(name)
    if not hasattr(message, "get_fields_and_field_types"):
        raise _unknown(name)
    fields = message.get_fields_and_field_types()
    has_header = next(iter(fields.values()), "") == "std_msgs/Header"
    return Kind(name, message, ENCAPSULATION + least_size(fields, _fields_of), has_header)


@cache
def service_kind(name: str) -> ServiceKind:
    """The service type called `pkg/srv/Name`, or a part of an action. Raises UnknownTypeError."""
    service = _load(name)
    if not hasattr(service, "Request"):
        raise _unknown(name)
    least = (
        ENCAPSULATION + least_size(part.get_fields_and_field_types(), _fields_of)
        for part in (service.Request, service.Response)
    )
    return ServiceKind(name, service, *least)


def is_cdr(octets: bytes, least: int) -> bool:
    """Whether octets from the air can be CDR of a type whose least size is `least`."""
    return len(octets) >= least and octets[:2] in (b"\0\0", b"\0\1")


def least_size(fields: Fields, of: Callable[[str], Fields]) -> int:
    """The smallest size of a message with these fields in CDR, without its encapsulation.

    `of` gives the fields of a nested type.
    """
    at, _ = _struct(fields, of, 0, is_exact=True)
    return at


def _struct(
    fields: Fields, of: Callable[[str], Fields], at: int, is_exact: bool
) -> tuple[int, bool]:
    if not fields:
        return at + 1, is_exact
    for each in fields.values():
        at, is_exact = _field(each, of, at, is_exact)
    return at, is_exact


def _field(text: str, of: Callable[[str], Fields], at: int, is_exact: bool) -> tuple[int, bool]:
    """(end of a field that begins at `at`, whether the end of each such field is there).

    Behind a field of variable size the alignment is not known, so no padding is counted.
    """
    if (size := _SIZES.get(text)) is not None:
        return (_aligned(at, size) if is_exact else at) + size, is_exact
    if text.startswith("sequence<") or _TEXT.fullmatch(text):
        return (_aligned(at, _LENGTH) if is_exact else at) + _LENGTH, False
    if (array := _ARRAY.fullmatch(text)) is not None:
        for _ in range(int(array[2])):
            at, is_exact = _field(array[1], of, at, is_exact)
        return at, is_exact
    return _struct(of(text), of, at, is_exact)


def _aligned(at: int, size: int) -> int:
    return at + -at % min(size, MOST_ALIGNED)


def _fields_of(name: str) -> Fields:
    package, _, last = name.partition("/")
    # The parts of an action are nested types, too.
    names = (f"{package}/{folder}/{last}" for folder in FOLDERS)
    found = next((each for each in names if _is_there(each)), f"{package}/msg/{last}")
    return dict(_load(found).get_fields_and_field_types())


def _is_there(name: str) -> bool:
    try:
        _load(name)
    except UnknownTypeError:
        return False
    return True


def _load(name: str) -> Any:  # noqa: ANN401
    given = _NAME.fullmatch(name)
    if given is None or not _has_messages(given[1], given[2]):
        raise _unknown(name)
    try:
        found = importlib.import_module(f"{given[1]}.{given[2]}")
        if given[2] != "action":
            return getattr(found, given[3])
        action, _, part = given[3].rpartition("_")
        return _PARTS[part](getattr(found, action))
    except (ImportError, AttributeError, KeyError):
        raise _unknown(name) from None


def _has_messages(package: str, folder: str) -> bool:
    """Whether a package has ROS types. It is not imported: its name may come from the air."""
    spec = importlib.util.find_spec(package)
    folders = spec.submodule_search_locations if spec is not None else None
    return any((Path(each) / folder / "__init__.py").exists() for each in folders or ())


def _unknown(name: str) -> UnknownTypeError:
    package = name.partition("/")[0].replace("_", "-")
    return UnknownTypeError(
        f"{name}: this type is not installed here; install its package, "
        f"ros-$ROS_DISTRO-{package}, or source the workspace that has it"
    )
