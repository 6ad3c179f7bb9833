"""The kinds of radio: a table of built-in ones, and those that other packages add.

A package adds a radio by an entry point of the group `sdrlinkd.backends`, whose value is
`module:ENTRY`, a Backend. The entry point is loaded when its name is used, not before, so a broken
package harms only those who name its radio. A built-in name always means the built-in radio.
"""

import sys
from functools import cache
from typing import TYPE_CHECKING

import msgspec

from backends import known
from backends.backend import Backend
from backends.base import BackendError
from backends.params import EtherParams, IqFileParams, LoopbackParams, ZmqParams
from backends.soapy import SoapyParams, soapy_presumption, soapy_problem, soapy_unchecked

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "sdrlinkd.backends"

BUILT_IN = {
    each.name: each
    for each in (
        Backend(
            name="loopback",
            settings=LoopbackParams,
            make="backends.making:make_loopback",
            is_hardware=False,
            may_be_away=False,
            presume=known.alone,
        ),
        Backend(
            name="iqfile",
            settings=IqFileParams,
            make="backends.making:make_iqfile",
            is_hardware=False,
            files=("receive", "transmit"),
            is_timed=False,
            starts_time=True,
            may_be_away=False,
            problem=known.iqfile_problem,
            unchecked=known.iqfile_unchecked,
            presume=known.alone,
        ),
        Backend(
            name="ether",
            settings=EtherParams,
            make="backends.making:make_ether",
            is_hardware=False,
            files=("dir",),
            heeds_patience=True,
            keeps_pace=known.ether_keeps_pace,
            problem=known.ether_problem,
            unchecked=known.ether_unchecked,
            presume=known.ether_presumption,
        ),
        Backend(
            name="soapy",
            settings=SoapyParams,
            make="backends.making:make_soapy",
            heeds_patience=True,
            problem=soapy_problem,
            unchecked=soapy_unchecked,
            presume=soapy_presumption,
        ),
        Backend(
            name="zmq",
            settings=ZmqParams,
            make="backends.making:make_zmq",
            is_hardware=False,
            problem=known.zmq_problem,
            unchecked=known.zmq_unchecked,
            presume=known.zmq_presumption,
        ),
    )
}
"""The built-in radios by name, in the order in which they are listed."""


def installed_names() -> list[str]:
    """The names of radios that other packages add; none of those packages is loaded."""
    return sorted(set(_entry_points()) - set(BUILT_IN))


def find_backend(name: str) -> Backend:
    """Return the radio of that name. Raises BackendError: unknown, broken, or in two packages."""
    if name in BUILT_IN:
        return BUILT_IN[name]
    found = _entry_points().get(name, [])
    if not found:
        names = ", ".join(f'"{each}"' for each in [*BUILT_IN, *installed_names()])
        raise BackendError(f'backend: got "{name}"; allowed: one of {names}')
    if len(found) > 1:
        packages = " and ".join(sorted(_package(each) for each in found))
        raise BackendError(
            f'backend: got "{name}", which several packages define: {packages}; '
            "allowed: a name that one package defines; uninstall the others"
        )
    return _loaded(found[0])


def _entry_points() -> dict[str, list["EntryPoint"]]:
    return _entry_points_on(tuple(sys.path))


@cache
def _entry_points_on(_path: tuple[str, ...]) -> dict[str, list["EntryPoint"]]:
    """The entry points of our group by name, along Python's current module search path."""
    # Imported here: loading it takes longer than using it, and most configurations need none.
    from importlib.metadata import entry_points

    found: dict[str, list[EntryPoint]] = {}
    for each in entry_points(group=GROUP):
        found.setdefault(each.name, []).append(each)
    return found


def _loaded(point: "EntryPoint") -> Backend:
    try:
        entry = point.load()
    except Exception as error:
        # Third-party code may fail in any way.
        raise _broken(point, f"cannot be loaded ({type(error).__name__}: {error})") from error
    if not isinstance(entry, Backend):
        raise _broken(point, f"is of type {type(entry).__name__}, not backends.Backend")
    if entry.name != point.name:
        raise _broken(point, f'calls itself "{entry.name}"')
    try:
        is_usable = isinstance(entry.settings(), msgspec.Struct)
    except TypeError:
        is_usable = False
    if not is_usable:
        raise _broken(
            point, "has settings that are not a msgspec.Struct with a default for each key"
        )
    return entry


def _broken(point: "EntryPoint", how: str) -> BackendError:
    return BackendError(
        f'backend: got "{point.name}" of package {_package(point)}, but its entry '
        f"{point.value} {how}; allowed: another backend, or an intact package"
    )


def _package(point: "EntryPoint") -> str:
    return f"{point.dist.name} {point.dist.version}" if point.dist else "of an unknown name"
