"""Describes the receiver's search range in frequency, in words."""

from sdrlinkd.config.pdu_links import ModemParams


def cfo_told(modem: ModemParams) -> str:
    """The frequency offset up to which bursts are searched, and why, in one line."""
    searched = f"the receiver searches for bursts up to {modem.searched_cfo_hz / 1e3:.3g} kHz off"
    if modem.max_cfo_hz != "auto":
        return f"{searched} (modem.max_cfo_hz)"
    return (
        f"{searched}: two crystals of ±{modem.crystal_ppm:g} ppm (modem.crystal_ppm) at "
        f"{modem.centre_hz / 1e6:g} MHz can be {modem.apart_hz / 1e3:.3g} kHz apart"
    )


def cfo_warning(modem: ModemParams) -> str:
    """A warning if two radios may be too far apart in frequency to hear each other; else empty."""
    if modem.frequency_hz == 0 or modem.searched_cfo_hz >= modem.apart_hz:
        return ""
    apart = "" if modem.max_cfo_hz == "auto" else f", but they can be {modem.apart_hz:g} Hz apart"
    key = "modem.rate_hz" if modem.max_cfo_hz == "auto" else "modem.max_cfo_hz"
    return (
        f"{cfo_told(modem)}{apart}; radios farther apart do not hear each other: raise {key}, or "
        "state better crystals (modem.crystal_ppm)"
    )
