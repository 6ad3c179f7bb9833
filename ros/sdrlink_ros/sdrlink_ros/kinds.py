"""Message types by name: their classes, what fits them, and whether they begin with a header."""

import importlib
import importlib.util
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from sdrlink_ros.cdr import Fields, Fits, fits

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


class UnknownTypeError(Exception):
    """A message type that is not installed here; the message says what to install."""


class Kind(NamedTuple):
    """A message type; `fits` tells whether octets are CDR of it."""

    name: str
    message: Any
    fits: Fits
    has_header: bool


class ServiceKind(NamedTuple):
    """A service type; `fits_…` tell whether octets are CDR of its request, and of its response."""

    name: str
    service: Any
    fits_request: Fits
    fits_response: Fits


@cache
def kind(name: str) -> Kind:
    """The type called `pkg/msg/Name`. Raises UnknownTypeError."""
    message = _load(name)
    if not hasattr(message, "get_fields_and_field_types"):
        raise _unknown(name)
    fields = message.get_fields_and_field_types()
    has_header = next(iter(fields.values()), "") == "std_msgs/Header"
    return Kind(name, message, fits(fields, _fields_of), has_header)


@cache
def service_kind(name: str) -> ServiceKind:
    """The service type called `pkg/srv/Name`, or a part of an action. Raises UnknownTypeError."""
    service = _load(name)
    if not hasattr(service, "Request"):
        raise _unknown(name)
    parts = (service.Request, service.Response)
    request, response = (fits(each.get_fields_and_field_types(), _fields_of) for each in parts)
    return ServiceKind(name, service, request, response)


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
