"""The configuration: from TOML to typed structs to the objects that build the parts."""

from sdrlinkd.config.backends import backend_of, typed_config
from sdrlinkd.config.describe import allowed as allowed_text
from sdrlinkd.config.describe import given as given_text
from sdrlinkd.config.fleet import ENDPOINT, FLEET_NAME, FleetParams
from sdrlinkd.config.load import explain_policy, load_config, parse_config, parse_toml
from sdrlinkd.config.not_checked import unchecked
from sdrlinkd.config.offsets import cfo_told, cfo_warning
from sdrlinkd.config.pdu_links import (
    SIMULATED_HZ,
    ChannelParams,
    DirectParams,
    ModemParams,
    PlayParams,
    TransformParams,
)
from sdrlinkd.config.places import located
from sdrlinkd.config.quantities import example as unit_example
from sdrlinkd.config.radios import GnuRadioParams
from sdrlinkd.config.schema import WITHOUT_AIR, BusParams, Config
from sdrlinkd.config.setup import TF_TYPE, UNBOUNDED_TYPES, Setup, make_setup
from sdrlinkd.config.topics import load_registry, policies_by_type

__all__ = [
    "ENDPOINT",
    "FLEET_NAME",
    "SIMULATED_HZ",
    "TF_TYPE",
    "UNBOUNDED_TYPES",
    "WITHOUT_AIR",
    "BusParams",
    "ChannelParams",
    "Config",
    "DirectParams",
    "FleetParams",
    "GnuRadioParams",
    "ModemParams",
    "PlayParams",
    "Setup",
    "TransformParams",
    "allowed_text",
    "backend_of",
    "cfo_told",
    "cfo_warning",
    "explain_policy",
    "given_text",
    "load_config",
    "load_registry",
    "located",
    "make_setup",
    "parse_config",
    "parse_toml",
    "policies_by_type",
    "typed_config",
    "unchecked",
    "unit_example",
]
