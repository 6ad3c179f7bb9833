"""Checks that the sections of modem, radios and simulated air agree with each other."""

from collections.abc import Iterable
from pathlib import Path
from typing import TypeVar

import msgspec

from backends import BUILT_IN
from sdrlinkd.config.backends import backend_of
from sdrlinkd.config.schema import WITHOUT_AIR, Config
from sdrlinkd.errors import ConfigError

LEAST_HZ = 1e4
"""Below, no radio tunes; whoever gives less has left out the unit."""
S = TypeVar("S", bound=msgspec.Struct)


def check_pdu_link(config: Config) -> None:
    """Check that the settings of modem, radios and simulated air agree with each other.

    Raises ConfigError, which begins with the key and says what was given and what is allowed.
    """
    _check_sharing(config)
    if config.backend == "gnuradio":
        _check_flowgraph(config)
    if config.backend in WITHOUT_AIR:
        return
    modem = config.modem
    if modem.searched_cfo_hz > modem.most_cfo_hz:
        raise ConfigError(
            f"modem.max_cfo_hz: got {modem.searched_cfo_hz:g}; allowed: at most a "
            f'quarter of modem.rate_hz, {modem.most_cfo_hz:g}, or "auto"'
        )
    if 0 < modem.frequency_hz < LEAST_HZ:
        meant = f'; write "{modem.frequency_hz:g} MHz"?' if modem.frequency_hz >= 1 else ""
        raise ConfigError(
            f"modem.frequency_hz: got {modem.frequency_hz:g} Hz; allowed: 0 (not set), or at least "
            f"{LEAST_HZ / 1e3:g} kHz{meant}"
        )
    radio = backend_of(config)
    problem = radio.problem(config.backend_settings, config.radio_needs) if radio else ""
    if problem:
        raise ConfigError(problem)


def _check_flowgraph(config: Config) -> None:
    params = config.gnuradio
    is_socket = params.transport in ("udp", "tcp")
    example = '"127.0.0.1:52001"' if is_socket else '"tcp://127.0.0.1:52001"'
    for key in ["send"] if is_socket else ["send", "receive"]:
        if not getattr(params, key):
            raise ConfigError(
                f'gnuradio.{key}: got ""; allowed with backend = "gnuradio": where the flowgraph '
                f"is, such as {example}"
            )


def _check_sharing(config: Config) -> None:
    policy = config.access.policy
    if policy not in ("auto", "none") and config.backend in WITHOUT_AIR:
        raise ConfigError(
            f'access.policy: got "{policy}", but the backend "{config.backend}" has no '
            "channel to sense; "
            'allowed: "auto" or "none", or a backend with a radio'
        )
    if config.rate.min_mcs > config.rate.max_mcs:
        raise ConfigError(
            f"rate.min_mcs: got {config.rate.min_mcs}; allowed: at most rate.max_mcs, "
            f"{config.rate.max_mcs}"
        )


def with_paths(config: Config, base: Path) -> Config:
    """`config` with relative file names resolved against `base`, except the registry's."""
    base, radio = base.absolute(), backend_of(config)
    named = {name: each.files for name, each in BUILT_IN.items()}
    if radio is not None:
        named[radio.name] = radio.files
    changes = {
        name: _with_whole(getattr(config, name), keys, base) for name, keys in named.items() if keys
    }
    return msgspec.structs.replace(
        config,
        **changes,
        play=_with_whole(config.play, ("bag",), base),
        security=_with_whole(config.security, ("keys", "state_dir"), base),
        topic={
            name: _with_whole(policy, ("dictionary",), base)
            for name, policy in config.topic.items()
        },
    )


def _with_whole(section: S, keys: Iterable[str], base: Path) -> S:
    """`section` with the file names under `keys` resolved; empty ones stay empty."""
    given = {key: getattr(section, key) for key in keys}
    whole = {key: str(base / name) for key, name in given.items() if name}
    return msgspec.structs.replace(section, **whole) if whole else section
