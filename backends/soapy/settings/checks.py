"""What follows from [soapy] and the modem before the device is opened."""

import msgspec

from backends.backend import ModemNeeds, Presumption
from backends.soapy.binding import driver_of
from backends.soapy.settings.driver_profiles import profile_of
from backends.soapy.settings.params import SoapyParams
from backends.soapy.settings.presumed import presume
from backends.soapy.settings.soapy_settings import SoapySettings


def soapy_problem(soapy: SoapyParams, needs: ModemNeeds) -> str:
    """What is wrong with [soapy] for that modem: key, given, allowed; empty: nothing."""
    if not soapy.device:
        return (
            'soapy.device: got ""; allowed with backend = "soapy": a device, such as '
            '"driver=hackrf"; `sdrlinkctl radio probe` lists the attached ones'
        )
    if "=" not in soapy.device:
        return (
            f'soapy.device: got "{soapy.device}"; allowed: KEY=VALUE,KEY=VALUE,… such as '
            f'"driver={soapy.device}"; `sdrlinkctl radio probe` lists the attached ones'
        )
    least_hz = profile_of(driver_of(soapy.device)).least_rate_hz
    if needs.radio_rate_hz < least_hz:
        return (
            f"modem.rate_hz: got {needs.rate_hz / 1e6:g} Msps with modem.oversampling = "
            f"{needs.oversampling}; allowed by this driver: at least {least_hz / 1e6:g} Msps at "
            "the radio (modem.rate_hz × modem.oversampling)"
        )
    if not needs.frequency_hz:
        return (
            'modem.frequency_hz: got 0 (not set); allowed with backend = "soapy": a '
            "frequency that your radio, antenna and licence cover, such as 433.5e6"
        )
    if soapy.tx_enabled and soapy.tx_gain_db is None and not soapy.tx_gains:
        return (
            "soapy.tx_gain_db: not set; allowed with soapy.tx_enabled = true: a gain in "
            "dB, or soapy.tx_gains by element; start low; `sdrlinkctl radio probe` shows the range"
        )
    if soapy.offset_tuning == "on" and needs.oversampling == 1:
        return (
            'soapy.offset_tuning: got "on" with modem.oversampling = 1; allowed: '
            "modem.oversampling = 2 or 4, which makes room for the oscillator beside the channel"
        )
    return ""


def soapy_unchecked(soapy: SoapyParams) -> list[str]:
    """What cannot be checked about [soapy] before the device is opened."""
    keys = ["frequency", "rate", "antennas" if soapy.rx_antenna or soapy.tx_antenna else ""]
    if soapy.tx_gains or soapy.rx_gains or (soapy.tx_gain_db, soapy.rx_gain_db) != (None, None):
        keys.append("gains")
    if soapy.settings or soapy.stream_args:
        keys.append("settings")
    asked = ", ".join(key for key in keys if key)
    told = f'whether "{soapy.device}" is there and takes this {asked}'
    return [f"{told} (the device is not opened; sdrlinkctl doctor --config FILE opens it)"]


def soapy_presumption(
    soapy: SoapyParams, needs: ModemNeeds, turnaround_s: float | None
) -> Presumption:
    """Presume the device's properties from its driver, as if tx_enabled were set."""
    settings = SoapySettings.of(soapy, needs.radio_rate_hz, needs.frequency_hz, needs.block_s)
    settings = msgspec.structs.replace(settings, tx_enabled=True)
    if turnaround_s is not None:
        settings = msgspec.structs.replace(settings, turnaround_s=turnaround_s)
    found = presume(settings)
    how = f"as known for drivers of the kind {found.driver}"
    if not found.driver:
        how = "assumed to send and receive at once and to keep time, because its driver is unknown"
    duplex = "full duplex" if found.capabilities.full_duplex else "half duplex"
    told = f"{soapy.device}: {duplex}, {how}"
    return Presumption(found.capabilities, told, is_sure=bool(found.driver))
