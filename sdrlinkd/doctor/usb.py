"""Checks radios on USB: whether they are plugged in, and whether this user may open them."""

import grp
import os
from pathlib import Path
from typing import NamedTuple

from sdrlinkd.doctor.finding import Finding, bad, good, none

# Vendor and product ids, as lsusb shows them, by SoapySDR driver.
KNOWN = {
    "hackrf": {"1d50:6089": "HackRF One", "1d50:604b": "HackRF Jawbreaker"},
    "uhd": {"2500:0020": "USRP B200/B210", "2500:0021": "USRP B2x0", "2500:0022": "USRP B205mini"},
    "lime": {"0403:601f": "LimeSDR", "1d50:6108": "LimeSDR USB"},
    "bladerf": {"2cf0:5246": "bladeRF", "2cf0:5250": "bladeRF 2.0", "1d50:6066": "bladeRF"},
    "plutosdr": {"0456:b673": "ADALM-Pluto"},
    "rtlsdr": {"0bda:2838": "RTL2838", "0bda:2832": "RTL2832U"},
    "airspy": {"1d50:60a1": "Airspy"},
}


ON_USB = tuple(KNOWN)
NETWORKED = ("addr=", "remote", "hostname=", "uri=ip:")
"""Parts of soapy.device that indicate a radio on the network."""


def is_networked(device: str) -> bool:
    """Whether `device`, in the form of soapy.device, is connected by network and not by USB."""
    return any(key in device for key in NETWORKED)


class _Plugged(NamedTuple):
    driver: str
    title: str
    ids: str
    node: Path


def check_usb(driver: str, root: Path) -> list[Finding]:
    """Findings on whether known radios are plugged in and this user may open them.

    `driver` is that of soapy.device, "" for any. `root` is / or a copy of its /sys and /dev.
    """
    what = "USB device"
    plugged = [each for each in _plugged(root) if driver in ("", each.driver)]
    if driver and driver not in KNOWN:
        return [none(what, f'"{driver}" is not a driver known here')]
    if not plugged:
        if not driver:
            return [none(what, "no known radio is plugged in")]
        ids = ", ".join(KNOWN[driver])
        return [
            bad(
                what, f"no {driver} is plugged in (lsusb would show {ids})",
                "plug it in; try another cable or port, without a hub",
            )
        ]  # fmt: skip
    return [_of(each, what) for each in plugged]


def _of(each: _Plugged, what: str) -> Finding:
    told = f"{each.title} ({each.ids}) at {each.node}"
    if os.access(each.node, os.R_OK | os.W_OK):
        return good(what, f"{told}; this user may open it")
    try:
        group = grp.getgrgid(each.node.stat().st_gid).gr_name
    except (OSError, KeyError):
        group = "root"
    join = (
        f"sudo usermod -aG {group} $USER, then log in again"
        if group != "root"
        else "its udev rules are missing: install the driver's package, then plug it in again"
    )
    return bad(what, f"{told}; this user may not open it", join)


def _plugged(root: Path) -> list[_Plugged]:
    names = {
        ids: (driver, title) for driver, titles in KNOWN.items() for ids, title in titles.items()
    }
    found = []
    for folder in sorted((root / "sys/bus/usb/devices").glob("*")):
        vendor, product, bus, number = (
            _text(folder / key) for key in ("idVendor", "idProduct", "busnum", "devnum")
        )
        ids = f"{vendor}:{product}"
        if ids in names:
            node = root / f"dev/bus/usb/{int(bus or 0):03}/{int(number or 0):03}"
            found.append(_Plugged(*names[ids], ids, node))
    return found


def _text(path: Path) -> str:
    try:
        return path.read_text().strip()
    except OSError:
        return ""
