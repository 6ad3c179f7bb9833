"""Configuration: TOML → types → what the parts are built with."""

from sdrlinkd.config.load import load_config, parse_config
from sdrlinkd.config.schema import BusParams, Config, DirectParams
from sdrlinkd.config.setup import Setup, load_registry, make_setup

__all__ = [
    "BusParams",
    "Config",
    "DirectParams",
    "Setup",
    "load_config",
    "load_registry",
    "make_setup",
    "parse_config",
]
