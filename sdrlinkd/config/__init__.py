"""Configuration: TOML → types → what the parts are built with."""

from sdrlinkd.config.carriers import (
    ChannelParams,
    DirectParams,
    IqFileParams,
    LoopbackParams,
    ModemParams,
)
from sdrlinkd.config.load import load_config, parse_config
from sdrlinkd.config.schema import BusParams, Config
from sdrlinkd.config.setup import Setup, load_registry, make_setup

__all__ = [
    "BusParams",
    "ChannelParams",
    "Config",
    "DirectParams",
    "IqFileParams",
    "LoopbackParams",
    "ModemParams",
    "Setup",
    "load_config",
    "load_registry",
    "make_setup",
    "parse_config",
]
