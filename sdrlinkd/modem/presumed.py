"""The radio of a configuration, as far as it is known before it is open."""

from random import Random
from typing import NamedTuple

import msgspec

from backends import Capabilities, presume
from sdrlinkd.config import Config
from sdrlinkd.errors import ConfigError, UserError
from sdrlinkd.link import CarrierTraits, RateControl, settle
from sdrlinkd.modem.airtimes import Airtimes
from sdrlinkd.modem.radios import PDU_BACKENDS, soapy_settings
from sdrlinkd.modem.traits import carrier_traits

ETHER_TURNAROUND_S = 1e-4


class PresumedRadio(NamedTuple):
    """The traits of a radio, and of what it carries, as far as they are known.

    `presumption` says what only the radio can tell.
    """

    traits: CarrierTraits
    airtimes: Airtimes
    longest_s: float
    """The longest burst of any MCS in use."""
    full_duplex: bool
    presumption: str
    is_sure: bool
    """Whether the radio, once it is open, will be like that."""


def presume_radio(config: Config, turnaround_s: float | None = None) -> PresumedRadio:
    """The radio of `config`. Raises UserError where that has none.

    `turnaround_s` is taken in place of the one that is configured.
    """
    if config.backend in PDU_BACKENDS:
        raise UserError(
            f'backend: got "{config.backend}", which has no air to plan for: it hands PDUs on as '
            'they are; allowed: backend = "soapy", with [soapy] device = "driver=hackrf", or '
            '"ether", with [ether] dir = "FOLDER", or "zmq"; examples: etc/radios/hackrf.toml, '
            "etc/radios/usrp.toml"
        )
    can, presumption, is_sure = _capabilities(config, turnaround_s)
    airtimes = Airtimes(config.modem, config.link.pdu_size)
    traits = carrier_traits(config.backend, can, config.modem, airtimes)
    usable = RateControl(config.rate, traits.needed_snr_db, traits.mcs).usable
    return PresumedRadio(
        traits, airtimes, traits.longest_in_use_s(usable), can.full_duplex, presumption, is_sure
    )


def access_words(config: Config, own_id: int) -> list[str]:
    """What access comes to, in words. Raises ConfigError where it is sure to be refused."""
    if config.backend in PDU_BACKENDS:
        return [f'access none, as no other robot shares the air of the backend "{config.backend}"']
    radio = presume_radio(config)
    unsure = "" if radio.is_sure else "; what is not known without the radio: the radio itself"
    how = f" ({radio.presumption}{unsure})" if radio.presumption else ""
    try:
        settled = settle(config.access, own_id, radio.traits, radio.longest_s, Random(0))
    except ConfigError as error:
        if radio.is_sure:
            raise
        return [f"warning: the daemon may refuse this: {error}{how}"]
    return [f"access {settled.sentence}{how}"]


def _capabilities(config: Config, turnaround_s: float | None) -> tuple[Capabilities, str, bool]:
    """(what the radio can do, what of that is presumed, whether that is sure)."""
    modem = config.modem
    if config.backend == "soapy":
        # Access is planned for sending, also where that is switched off as yet.
        settings = msgspec.structs.replace(soapy_settings(config), tx_enabled=True)
        if turnaround_s is not None:
            settings = msgspec.structs.replace(settings, turnaround_s=turnaround_s)
        found = presume(settings)
        how = f"as drivers of the kind {found.driver} are known to be"
        if not found.driver:
            how = "taken for one that sends while it listens and keeps time, for its driver is not"
            how += " known here"
        duplex = "full duplex" if found.capabilities.full_duplex else "half duplex"
        told = f"{config.soapy.device}: {duplex}, {how}"
        return found.capabilities, told, bool(found.driver)
    if config.backend == "ether":
        from backends import ETHER_LEAD_S

        turn_s = ETHER_TURNAROUND_S if turnaround_s is None else turnaround_s
        return (
            _simulated(config, turn_s, ETHER_LEAD_S),
            (
                f"ether: taken for half duplex, turnaround {1e3 * turn_s:g} ms, in blocks of "
                f"{1e3 * modem.block_s:g} ms: the hub tells when the daemon is there"
            ),
            False,
        )
    lead_s = config.zmq.lead_s + modem.block_s if config.backend == "zmq" else 0.0
    return _simulated(config, turnaround_s, lead_s), "", True


def _simulated(config: Config, turnaround_s: float | None, lead_s: float) -> Capabilities:
    return Capabilities(
        receives=True,
        transmits=True,
        full_duplex=turnaround_s is None,
        timestamps=True,
        paced=True,
        lead_s=lead_s,
        turnaround_s=turnaround_s or 0.0,
        block_s=config.modem.block_s,
    )
