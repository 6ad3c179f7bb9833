"""Makes a modem from the configuration: in a process of its own, or in this one."""

from random import Random

import phy
from backends import Patience, Radio
from sdrlinkd.config import Config, ModemParams, backend_of
from sdrlinkd.errors import ConfigError
from sdrlinkd.link import PduLinkTraits, RateControl, may_share, settle
from sdrlinkd.modem.airtimes import Airtimes
from sdrlinkd.modem.link import ModemLink
from sdrlinkd.modem.modem import Modem
from sdrlinkd.modem.process import Loading, ModemHere, ModemProcess, RadioWanted, make_radio
from sdrlinkd.spawn import EarlyModem


def make_modem(
    config: Config,
    node_id: int,
    rng: Random,
    patience: Patience = Patience.NONE,
    began_s: float | None = None,
    loading: Loading | None = None,
    early: EarlyModem | None = None,
) -> ModemLink:
    """The modem on the radio that `config.backend` names. Raises ConfigError.

    `patience`: how long opening waits for an absent radio. `began_s`: start of the link's clock on
    the monotonic clock. `loading` compiles or loads the PHY, and knows how far that is. `early` may
    hold a modem process that was already started.
    """
    check_airtime(config)
    loading = loading or Loading()
    backend = backend_of(config)
    listens = may_share(config.access, node_id)
    # In a recording, time starts with its first sample.
    starts_s = None if backend is None or backend.starts_time else began_s
    longest_s = _longest_burst_s(config)

    async def choose() -> Modem:
        if backend is not None and await backend.keeps_pace(config.backend_settings, patience):
            wanted = RadioWanted(config, node_id, rng.getrandbits(32), longest_s, patience)
            return ModemProcess(wanted, listens, starts_s, loading.note, early)
        radio = make_radio(config, node_id, rng, longest_s, patience)
        return ModemHere(config.modem, config.link.pdu_size, radio, listens, starts_s, loading)

    return ModemLink(
        config.modem,
        config.link.pdu_size,
        choose,
        config.backend,
        lead_grows=lambda traits: _has_slots(config, node_id, traits),
        began_s=starts_s,
    )


def modem_on(
    params: ModemParams, pdu_size: int, radio: Radio, kind: str, listens: bool = False
) -> ModemLink:
    """A modem on `radio`, in this process."""

    async def choose() -> Modem:
        return ModemHere(params, pdu_size, radio, listens, None, Loading())

    return ModemLink(params, pdu_size, choose, kind)


def _has_slots(config: Config, node_id: int, traits: PduLinkTraits) -> bool:
    """Whether turns will have fixed times; errors show when the link is fitted to the radio."""
    longest_s = traits.longest_in_use_s(
        RateControl(config.rate, traits.needed_snr_db, traits.mcs).usable
    )
    try:
        policy = settle(
            config.access, node_id, traits, longest_s, Random(0), config.record_room
        ).policy
    except ConfigError:
        return False
    return policy in ("tdma", "grant")


def _longest_burst_s(config: Config) -> float:
    modem = config.modem
    return max(modem.max_burst_s, Airtimes(modem, config.link.pdu_size).airtime_s(0, 1))


def check_airtime(config: Config) -> None:
    """Raise ConfigError if one PDU takes so much airtime that receivers give up its message."""
    modem, size = config.modem, config.link.pdu_size
    airtime_s = phy.layout(phy.GRIDS[modem.grid], modem.mcs, 1, size).n_samples / modem.rate_hz
    if airtime_s > config.reassembly.timeout_s / 2:
        raise ConfigError(
            f"modem.rate_hz: got {modem.rate_hz:g}; a PDU of {size} B takes {airtime_s:.2g} s on "
            f"the air with {phy.MCS_TABLE[modem.mcs].name}; allowed: at most half of "
            f"reassembly.timeout_s, {config.reassembly.timeout_s / 2:g} s: raise modem.rate_hz or "
            "modem.mcs, or reduce link.pdu_size"
        )
