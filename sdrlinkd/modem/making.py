"""Makes a radio, and a modem with a radio, from the configuration."""

import math
from collections.abc import Awaitable, Callable
from random import Random

import phy
from backends import (
    BUILT_IN,
    BackendError,
    Channel,
    OversampledRadio,
    Patience,
    Radio,
    RadioRequest,
)
from sdrlinkd.config import Config, backend_of
from sdrlinkd.errors import ConfigError, UserError
from sdrlinkd.link import PduLinkTraits, RateControl, may_share, settle
from sdrlinkd.modem.airtimes import Airtimes
from sdrlinkd.modem.compiled import load_phy
from sdrlinkd.modem.link import ModemLink


def make_modem(
    config: Config,
    node_id: int,
    rng: Random,
    patience: Patience = Patience.NONE,
    began_s: float | None = None,
    load: Callable[[], Awaitable[None]] = load_phy,
) -> ModemLink:
    """The modem on the radio that `config.backend` names. Raises UserError.

    `patience`: how long opening waits for an absent radio. `began_s`: start of the link's clock on
    the monotonic clock. `load` compiles or loads the PHY.
    """
    check_airtime(config)
    access, backend = config.access, backend_of(config)
    return ModemLink(
        config.modem,
        config.link.pdu_size,
        make_radio(config, node_id, rng, _longest_burst_s(config), patience),
        config.backend,
        listens=may_share(access, node_id),
        lead_grows=lambda traits: _has_slots(config, node_id, traits),
        # In a recording, time starts with its first sample.
        began_s=None if backend is None or backend.starts_time else began_s,
        load=load,
    )


def make_radio(
    config: Config,
    node_id: int,
    rng: Random,
    longest_s: float,
    patience: Patience = Patience.NONE,
) -> Radio:
    """The radio that `config.backend` names, at the modem's rate. Raises UserError.

    `longest_s` is the length of the longest burst that it will get. `patience`: how long opening
    waits for an absent radio.
    """
    backend = backend_of(config)
    if backend is None:
        *names, last = (f'"{name}"' for name in BUILT_IN)
        raise ConfigError(
            f'backend: got "{config.backend}", which has no radio; allowed: {", ".join(names)} or '
            f"{last}"
        )
    request = RadioRequest(
        config.radio_needs,
        node_id,
        longest_s,
        patience,
        lambda: _channel(config, rng.getrandbits(32)),
    )
    try:
        radio = backend.radio(config.backend_settings, request)
    except BackendError as error:
        raise UserError(str(error)) from None
    factor = config.modem.oversampling
    return OversampledRadio(radio, factor) if factor > 1 else radio


def _has_slots(config: Config, node_id: int, traits: PduLinkTraits) -> bool:
    """Whether the access policy will be tdma; errors show when the link is fitted to the radio."""
    longest_s = traits.longest_in_use_s(
        RateControl(config.rate, traits.needed_snr_db, traits.mcs).usable
    )
    try:
        return settle(config.access, node_id, traits, longest_s, Random(0)).policy == "tdma"
    except ConfigError:
        return False


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


def _channel(config: Config, seed: int) -> Channel:
    """The simulated channel, with noise `snr_db` below bursts of the modem's own power.

    This holds in the modem's band; a radio at a higher sample rate receives more noise.
    """
    modem, air = config.modem, config.channel
    more_db = 10 * math.log10(modem.oversampling)
    return Channel(
        phy.PathParams(
            rate_hz=modem.rate_hz * modem.oversampling,
            centre_hz=modem.centre_hz,
            profile=air.profile,
            delay_spread_s=air.delay_spread_s,
            loss_db=air.loss_db,
            delay_s=air.delay_s,
            clock_ppm=air.clock_ppm,
            image_db=air.tx_image_db,
            leak_db=air.tx_leak_db,
        ),
        phy.FrontEndParams(
            noise_dbfs=-modem.backoff_db - air.snr_db + more_db,
            image_db=air.rx_image_db,
            dc_dbfs=air.rx_dc_dbfs,
            bits=air.adc_bits,
        ),
        seed,
    )
