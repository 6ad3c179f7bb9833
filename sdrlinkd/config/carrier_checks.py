"""What the sections of modem, radios and simulated air must agree on."""

from pathlib import Path

import msgspec

from backends import least_rate_hz
from sdrlinkd.config.schema import Config
from sdrlinkd.errors import ConfigError

WITHOUT_AIR = ("direct", "gnuradio")
"""Backends that carry PDUs, not samples."""


def check_carrier(config: Config) -> None:
    """Check what modem, radios and simulated air must agree on.

    Raises ConfigError that begins with the key, and says what was given and what is allowed.
    """
    _check_sharing(config)
    if config.backend in ("zmq", "gnuradio"):
        _check_endpoints(config)
    if config.backend in WITHOUT_AIR:
        return
    modem, iqfile = config.modem, config.iqfile
    if modem.searched_cfo_hz > modem.most_cfo_hz:
        raise ConfigError(
            f"modem.max_cfo_hz: got {modem.searched_cfo_hz:g}; allowed: at most a "
            f'quarter of modem.rate_hz, {modem.most_cfo_hz:g}, or "auto"'
        )
    if config.backend == "ether" and not config.ether.dir:
        raise ConfigError(
            'ether.dir: got ""; allowed with backend = "ether": the folder of a hub, as in '
            "sdrlink-ether --dir FOLDER"
        )
    if config.backend == "iqfile" and not (iqfile.receive or iqfile.transmit):
        raise ConfigError(
            'iqfile.receive, iqfile.transmit: both are ""; allowed with backend = "iqfile": a '
            "recording to play (name a recording, SigMF or raw), one to write, or both"
        )
    if config.backend == "soapy":
        _check_soapy(config)


def _check_soapy(config: Config) -> None:
    modem, soapy = config.modem, config.soapy
    if not soapy.device:
        raise ConfigError(
            'soapy.device: got ""; allowed with backend = "soapy": a device, such as '
            '"driver=hackrf"; those here are shown by: sdrlinkctl radio probe'
        )
    if "=" not in soapy.device:
        raise ConfigError(
            f'soapy.device: got "{soapy.device}"; allowed: KEY=VALUE, with commas between, such as '
            f'"driver={soapy.device}"; those here are shown by: sdrlinkctl radio probe'
        )
    least_hz = least_rate_hz(soapy.device)
    if modem.rate_hz * modem.oversampling < least_hz:
        raise ConfigError(
            f"modem.rate_hz: got {modem.rate_hz / 1e6:g} Msps with modem.oversampling = "
            f"{modem.oversampling}; allowed by this driver: at least {least_hz / 1e6:g} Msps at "
            "the radio (modem.rate_hz × modem.oversampling)"
        )
    if not modem.frequency_hz:
        raise ConfigError(
            'modem.frequency_hz: got 0 (not set); allowed with backend = "soapy": a '
            "frequency that radio, antenna and licence are for, such as 433.5e6"
        )
    if soapy.tx_enabled and soapy.tx_gain_db is None and not soapy.tx_gains:
        raise ConfigError(
            "soapy.tx_gain_db: not set; allowed with soapy.tx_enabled = true: a gain in "
            "dB, or soapy.tx_gains by element; begin low: sdrlinkctl radio probe shows the range"
        )
    if soapy.offset_tuning == "on" and modem.oversampling == 1:
        raise ConfigError(
            'soapy.offset_tuning: got "on" with modem.oversampling = 1; allowed: '
            "modem.oversampling 2 or 4, room for the oscillator beside the channel"
        )


def _check_endpoints(config: Config) -> None:
    backend = config.backend
    section = config.zmq if backend == "zmq" else config.gnuradio
    needed = ["send"] if config.gnuradio.transport in ("udp", "tcp") else ["send", "receive"]
    for key in ["send", "receive"] if backend == "zmq" else needed:
        if not getattr(section, key):
            example = '"tcp://127.0.0.1:52001"' if "receive" in needed else '"127.0.0.1:52001"'
            raise ConfigError(
                f'{backend}.{key}: got ""; allowed with backend = "{backend}": where '
                f"the flowgraph is, such as {example}"
            )


def _check_sharing(config: Config) -> None:
    policy = config.access.policy
    if policy not in ("auto", "none") and config.backend in WITHOUT_AIR:
        raise ConfigError(
            f'access.policy: got "{policy}", but the backend "{config.backend}" has no '
            "air that we could hear; "
            'allowed: "auto" or "none", or a backend with a radio'
        )
    if config.rate.min_mcs > config.rate.max_mcs:
        raise ConfigError(
            f"rate.min_mcs: got {config.rate.min_mcs}; allowed: at most rate.max_mcs, "
            f"{config.rate.max_mcs}"
        )


def with_paths(config: Config, base: Path) -> Config:
    """`config` with file names made whole that are relative to `base`; the registry's stays."""
    base = base.absolute()
    iqfile = config.iqfile
    whole = {
        key: str(base / getattr(iqfile, key)) if getattr(iqfile, key) else ""
        for key in ("receive", "transmit")
    }
    ether, play = config.ether, config.play
    return msgspec.structs.replace(
        config,
        iqfile=msgspec.structs.replace(iqfile, **whole),
        ether=msgspec.structs.replace(ether, dir=str(base / ether.dir) if ether.dir else ""),
        play=msgspec.structs.replace(play, bag=str(base / play.bag) if play.bag else ""),
        topic={
            name: msgspec.structs.replace(policy, dictionary=str(base / policy.dictionary))
            if policy.dictionary
            else policy
            for name, policy in config.topic.items()
        },
    )
