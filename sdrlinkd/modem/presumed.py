"""What is known about a configured radio before it is opened."""

from random import Random
from typing import NamedTuple

from sdrlinkd.config import WITHOUT_AIR, Config, backend_of
from sdrlinkd.errors import ConfigError, UserError
from sdrlinkd.link import PduLinkTraits, RateControl, settle
from sdrlinkd.modem.airtimes import Airtimes
from sdrlinkd.modem.traits import pdu_link_traits


class PresumedRadio(NamedTuple):
    """The presumed traits of a radio that is not open yet.

    `presumption` says in words what only the radio itself can tell.
    """

    traits: PduLinkTraits
    airtimes: Airtimes
    longest_s: float
    """Length of the longest burst of any MCS in use, in s."""
    full_duplex: bool
    presumption: str
    is_sure: bool
    """Whether the open radio will certainly have these traits."""


def presume_radio(config: Config, turnaround_s: float | None = None) -> PresumedRadio:
    """The presumed radio of `config`. Raises UserError if it has none.

    `turnaround_s` replaces the configured turnaround.
    """
    backend = backend_of(config)
    if backend is None:
        raise UserError(
            f'backend: got "{config.backend}", which has no channel to plan: it passes PDUs on '
            'unchanged; allowed: backend = "soapy", with [soapy] device = "driver=hackrf", or '
            '"ether", with [ether] dir = "FOLDER", or "zmq"; examples: etc/radios/hackrf.toml, '
            "etc/radios/usrp.toml"
        )
    can, presumption, is_sure = backend.presume(
        config.backend_settings, config.radio_needs, turnaround_s
    )
    airtimes = Airtimes(config.modem, config.link.pdu_size)
    traits = pdu_link_traits(config.backend, can, config.modem, airtimes)
    usable = RateControl(config.rate, traits.needed_snr_db, traits.mcs).usable
    return PresumedRadio(
        traits, airtimes, traits.longest_in_use_s(usable), can.full_duplex, presumption, is_sure
    )


def access_words(config: Config, own_id: int) -> list[str]:
    """The access policy that results, in words. Raises ConfigError if it will surely be refused."""
    if config.backend in WITHOUT_AIR:
        return [f'access none, because no other robot shares the backend "{config.backend}"']
    radio = presume_radio(config)
    unsure = "" if radio.is_sure else "; unknown until the radio is open: the radio itself"
    how = f" ({radio.presumption}{unsure})" if radio.presumption else ""
    try:
        settled = settle(
            config.access, own_id, radio.traits, radio.longest_s, Random(0), config.record_room
        )
    except ConfigError as error:
        if radio.is_sure:
            raise
        return [f"warning: the daemon may refuse this: {error}{how}"]
    return [f"access {settled.sentence}{how}"]
