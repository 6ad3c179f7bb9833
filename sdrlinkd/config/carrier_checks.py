"""What the sections of modem, radios and simulated air must agree on."""

from pathlib import Path

import msgspec

from sdrlinkd.config.schema import Config
from sdrlinkd.errors import ConfigError


def check_carrier(config: Config, source: str) -> None:
    """Raises ConfigError, citing key, given and allowed."""
    if config.backend == "direct":
        return
    modem, iqfile = config.modem, config.iqfile
    if modem.max_cfo_hz > modem.rate_hz / 4:
        raise ConfigError(
            f"{source}: modem.max_cfo_hz: got {modem.max_cfo_hz:g}; allowed: at most a quarter of "
            f"modem.rate_hz, {modem.rate_hz / 4:g}"
        )
    if config.backend == "iqfile" and not (iqfile.receive or iqfile.transmit):
        raise ConfigError(
            f'{source}: iqfile.receive, iqfile.transmit: both are ""; allowed: name a recording to '
            "play, one to write, or both"
        )


def with_paths(config: Config, base: Path) -> Config:
    """`config` with the recordings' names relative to `base` made whole."""
    iqfile = config.iqfile
    whole = {
        key: str(base / getattr(iqfile, key)) if getattr(iqfile, key) else ""
        for key in ("receive", "transmit")
    }
    return msgspec.structs.replace(config, iqfile=msgspec.structs.replace(iqfile, **whole))
