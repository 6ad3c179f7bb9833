"""The allowed values of the key `backend`, and the configuration's type with plugin radios."""

from collections.abc import Mapping
from functools import cache
from typing import Any, Literal, cast

import msgspec

import backends
from backends import Backend, BackendError
from sdrlinkd.config.schema import BACKENDS, WITHOUT_AIR, Config
from sdrlinkd.errors import ConfigError


def backend_of(config: Config) -> Backend | None:
    """The radio that `config.backend` names; None if the PDU link is not a radio.

    Raises ConfigError.
    """
    return None if config.backend in WITHOUT_AIR else _found(config.backend)


def config_type(raw: Mapping[str, object]) -> type[Config]:
    """The type of a configuration with these keys: `Config` and the sections of other packages.

    A package's code is loaded only if `raw` names its radio. Raises ConfigError.
    """
    if all(key in Config.__struct_fields__ for key in raw) and _is_ours(raw.get("backend")):
        # In the common case there is no need to search for packages.
        return Config
    names = [each for each in backends.installed_names() if each not in Config.__struct_fields__]
    named = [each for each in names if each in raw or each == raw.get("backend")]
    return _extended(tuple(names), tuple(_found(each) for each in named))


def typed_config(raw: Mapping[str, object]) -> Config:
    """The configuration in plain values, as another daemon reports it. Raises ConfigError."""
    try:
        return msgspec.convert(raw, config_type(raw))
    except msgspec.ValidationError as error:
        raise ConfigError(
            f"configuration of the daemon: unreadable here ({error}); allowed: that of a "
            "daemon of this version, with the package of its radio also installed here"
        ) from None


def _is_ours(name: object) -> bool:
    return name is None or name in BACKENDS


def _found(name: str) -> Backend:
    try:
        return backends.find_backend(name)
    except BackendError as error:
        raise ConfigError(str(error)) from None


@cache
def _extended(names: tuple[str, ...], named: tuple[Backend, ...]) -> type[Config]:
    """`Config` with all `names` as further values of `backend`, and a section for each of them.

    The sections of packages that are not `named` are not checked: the file has none.
    """
    if not names:
        return Config
    settings: dict[str, type[Any]] = {each.name: each.settings for each in named}
    types = {name: settings.get(name, dict[str, object]) for name in names}
    fields: list[tuple[str, Any, Any]] = [
        ("backend", Literal[(*BACKENDS, *names)], Config().backend),
        *((name, kind, msgspec.field(default_factory=kind)) for name, kind in types.items()),
    ]
    made: Any = msgspec.defstruct(
        "Config", fields, bases=(Config,), module=__name__, frozen=True, kw_only=True,
        forbid_unknown_fields=True,
    )  # fmt: skip
    return cast(type[Config], made)
