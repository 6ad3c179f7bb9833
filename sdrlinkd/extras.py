"""Packages that not every robot needs: what lacks them, and the line that installs them."""

import contextlib
import importlib.util
import re
import shlex
import sys
from collections.abc import Iterator
from importlib import metadata
from typing import NamedTuple

from sdrlinkd.errors import UserError
from sdrlinkd.shipped import IN_TREE


class Extra(NamedTuple):
    """An extra of the distribution: what needs it, and the modules that it brings."""

    needed: str
    modules: tuple[str, ...]


EXTRAS = {
    "foxglove": Extra("the bridge needs Foxglove's SDK", ("foxglove",)),
    "metrics": Extra("the exporter needs prometheus-client", ("prometheus_client",)),
    "plots": Extra("pictures and reports need matplotlib and Jinja2", ("matplotlib", "jinja2")),
    "web": Extra("the page needs NiceGUI", ("nicegui", "PIL", "zenoh", "xxhash")),
    "zenoh": Extra("the gateway needs Zenoh", ("zenoh", "xxhash")),
}


@contextlib.contextmanager
def needs(name: str) -> Iterator[None]:
    """Around an import that needs an extra. Raises UserError with the line that installs it."""
    try:
        yield
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in EXTRAS[name].modules:
            raise
        raise UserError(hint(name)) from None


def lacking(name: str) -> str:
    """The hint on an extra that is not installed; "" if it is."""
    there = all(map(importlib.util.find_spec, EXTRAS[name].modules))
    return "" if there else hint(name)


def hint(name: str) -> str:
    """What needs an extra, and the line that installs it."""
    return f"{EXTRAS[name].needed}: {install_line(*_packages(name))}"


def install_line(*requirements: str) -> str:
    """The line that installs packages into the environment of this program."""
    return shlex.join([sys.executable, "-m", "pip", "install", *requirements])


def _packages(name: str) -> list[str]:
    """Those of an extra by their own names, as no index needs to know ours."""
    try:
        found = metadata.requires("sdrlinkd") or []
    except metadata.PackageNotFoundError:
        # A source tree that is not installed.
        return [f"{IN_TREE}[{name}]"]
    is_of_it = re.compile(rf"""\bextra == ["']{name}["']""")
    return [each.partition(";")[0].strip() for each in found if is_of_it.search(each)]
