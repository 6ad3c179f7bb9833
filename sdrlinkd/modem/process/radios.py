"""Makes the radio that the configuration names."""

import math
import os
from random import Random
from typing import TYPE_CHECKING

import backends
import phy
from backends import BUILT_IN, BackendError, Patience, Radio, RadioRequest
from sdrlinkd.config import Config, backend_of
from sdrlinkd.errors import ConfigError, UserError

if TYPE_CHECKING:
    # The simulated air needs compiled code, which is loaded with the first one.
    from backends import Channel


def make_radio(
    config: Config,
    node_id: int,
    rng: Random,
    longest_s: float,
    patience: Patience = Patience.NONE,
    pid: int | None = None,
) -> Radio:
    """The radio that `config.backend` names, at the modem's rate. Raises UserError.

    `longest_s` is the length of the longest burst that it will get. `patience`: how long opening
    waits for an absent radio. `pid`: its daemon, None: this process.
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
        os.getpid() if pid is None else pid,
    )
    try:
        radio = backend.radio(config.backend_settings, request)
    except BackendError as error:
        raise UserError(str(error)) from None
    factor = config.modem.oversampling
    return backends.OversampledRadio(radio, factor) if factor > 1 else radio


def _channel(config: Config, seed: int) -> "Channel":
    """The simulated channel, with noise `snr_db` below bursts of the modem's own power.

    This holds in the modem's band; a radio at a higher sample rate receives more noise.
    """
    modem, air = config.modem, config.channel
    more_db = 10 * math.log10(modem.oversampling)
    return backends.Channel(
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
        air.jammer,
    )
