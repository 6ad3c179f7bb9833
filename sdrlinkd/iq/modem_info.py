"""What the modem offers at a sample rate: grid, bit rates, airtimes."""

import msgspec

import phy
from sdrlinkd.config import SIMULATED_HZ, ModemParams, cfo_told, cfo_warning
from sdrlinkd.errors import UserError


class McsInfo(msgspec.Struct, frozen=True, kw_only=True):
    """One MCS at one sample rate and PDU size; `rate_bit_s` excludes preamble and header."""

    mcs: int
    name: str
    rate_bit_s: float
    one_pdu_ms: float
    burst_pdus: int
    burst_ms: float
    burst_goodput_bit_s: float
    """PDU bits per s in the longest burst, including preamble and header."""
    snr_db: float
    """SNR in the sampled band at which 1 % of these PDUs are lost, by the model of rate control."""


class ModemInfo(msgspec.Struct, frozen=True, kw_only=True):
    """The OFDM grid at one sample rate, with every MCS."""

    rate_hz: float
    pdu_size: int
    max_burst_s: float
    n_fft: int
    n_cp: int
    n_data: int
    n_pilots: int
    spacing_hz: float
    occupied_hz: float
    symbol_us: float
    echoes_us: float
    """Longest multipath delay that the cyclic prefix absorbs, in µs."""
    preamble_us: float
    """Length of preamble and header of each burst, in µs."""
    frequency_hz: float
    max_cfo_hz: float
    """Largest frequency offset at which bursts are searched, in Hz; `cfo` says it in words."""
    cfo: str
    mcs: list[McsInfo]


def modem_info(
    rate_hz: float,
    pdu_size: int,
    max_burst_s: float,
    grid: phy.Numerology = phy.OFDM_64_16,
    frequency_hz: float = SIMULATED_HZ,
    crystal_ppm: float = ModemParams().crystal_ppm,
) -> ModemInfo:
    """What the modem offers at a sample rate, with PDUs and bursts of these sizes.

    The searched frequency offset follows from the centre frequency and the radios' crystals. Raises
    UserError.
    """
    params = ModemParams(rate_hz=rate_hz, frequency_hz=frequency_hz, crystal_ppm=crystal_ppm)
    try:
        rows = [_mcs_info(grid, each, rate_hz, pdu_size, max_burst_s) for each in phy.MCS_TABLE]
    except ValueError as error:
        raise UserError(str(error)) from None
    one = phy.layout(grid, 0, 1, pdu_size)
    opening = one.n_samples - one.n_symbols * grid.n_symbol
    return ModemInfo(
        rate_hz=rate_hz,
        pdu_size=pdu_size,
        max_burst_s=max_burst_s,
        n_fft=grid.n_fft,
        n_cp=grid.n_cp,
        n_data=grid.n_data,
        n_pilots=len(grid.pilots),
        spacing_hz=rate_hz / grid.n_fft,
        occupied_hz=(grid.n_used + 1) * rate_hz / grid.n_fft,
        symbol_us=grid.n_symbol / rate_hz * 1e6,
        echoes_us=grid.n_cp / rate_hz * 1e6,
        preamble_us=opening / rate_hz * 1e6,
        frequency_hz=frequency_hz,
        max_cfo_hz=params.searched_cfo_hz,
        cfo=cfo_warning(params) or cfo_told(params),
        mcs=rows,
    )


def _mcs_info(
    grid: phy.Numerology, mcs: phy.Mcs, rate_hz: float, pdu_size: int, max_burst_s: float
) -> McsInfo:
    one = phy.layout(grid, mcs.index, 1, pdu_size)
    n_pdus = phy.most_pdus(grid, mcs.index, pdu_size, round(max_burst_s * rate_hz))
    burst = phy.layout(grid, mcs.index, n_pdus, pdu_size)
    burst_s = burst.n_samples / rate_hz
    return McsInfo(
        mcs=mcs.index,
        name=mcs.name,
        rate_bit_s=float(mcs.bits_per_subcarrier) * grid.n_data * rate_hz / grid.n_symbol,
        one_pdu_ms=one.n_samples / rate_hz * 1e3,
        burst_pdus=n_pdus,
        burst_ms=burst_s * 1e3,
        burst_goodput_bit_s=8 * pdu_size * n_pdus / burst_s,
        snr_db=round(phy.needed_snr_db(mcs.index, pdu_size), 2),
    )
