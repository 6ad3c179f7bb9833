"""A device at the other end of SoapyRemote: the same radio, over a network."""

import asyncio
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from backends import SoapyRadio, SoapySettings, Tuning, TxBurst
from tests.backends.radios import noise, opened, send, take
from tests.machine import ROOT as NO_ROOT
from tests.machine import lacks
from tests.soapy_loopback import missing, module_folder

ROOT = Path(__file__).parents[2]
NEEDS = {
    "unshare": "util-linux",
    "ip": "iproute2",
    "ss": "iproute2",
    "dbus-daemon": "dbus",
    "avahi-daemon": "avahi-daemon",
    "SoapySDRServer": "soapyremote-server",
}
NO_SERVER = 77
NAMESPACES = ("unshare", "--net", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc")
RATE = 1e6


def lacking():
    """Why no server can run here; "" if one can."""
    if why := missing():
        return why
    if absent := [package for name, package in NEEDS.items() if not shutil.which(name)]:
        return lacks(*absent)
    if os.geteuid():
        return f"{NO_ROOT}, for namespaces of its own"
    may = subprocess.run([*NAMESPACES, "true"], capture_output=True, check=False)
    return "needs namespaces of its own" if may.returncode else ""


@pytest.mark.long
@pytest.mark.realtime
@pytest.mark.skipif(bool(lacking()), reason=lacking())
def test_a_device_behind_soapyremote_keeps_time_as_if_it_were_here():
    # The driver module is among the system's modules.
    environment = {**os.environ, "SOAPY_SDR_PLUGIN_PATH": str(module_folder())}
    environment.pop("SOAPY_SDR_ROOT", None)
    done = subprocess.run(
        [
            *NAMESPACES,
            *("sh", str(ROOT / "tests" / "soapy_loopback" / "remote.sh")),
            *(sys.executable, "-m", "tests.backends.test_soapy_remote"),
        ],
        cwd=ROOT, capture_output=True, text=True, check=False, timeout=100,
        env=environment,
    )  # fmt: skip
    if done.returncode == NO_SERVER:
        pytest.skip("SoapySDRServer finds no avahi here")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["outcome"] == "sent"
    assert (told["slip"], told["found_at"]) == (0, 0)
    assert told["gain"] == pytest.approx(1, abs=0.01)
    assert not any(told["counters"].values())


async def hear_a_burst():
    """Send and hear a burst through the device behind the server."""
    device = "driver=remote,remote=127.0.0.1:55132,remote:driver=loopback,remote:model=plain"
    radio = SoapyRadio(
        SoapySettings(
            device=f"{device},remote:self=yes,remote:noise_db=-200",
            rate_hz=0.0, frequency_hz=0.0, tx_enabled=True, tx_gain_db=40.0, rx_gain_db=20.0,
            lead_s=0.1, stream_args={"remote:prot": "tcp"}, dc_block=False,
        ),
        longest_s=0.1,
    )  # fmt: skip
    async with opened(radio, Tuning(RATE, 868e6)):
        blocks = radio.blocks()
        begin = (await take(blocks, 100_000))[-1].index
        burst = TxBurst(begin + 300_000, noise(3000))
        (report,), taken = await send(radio, blocks, [burst])
        taken += await take(blocks, taken[-1].index + 20_000)
        stream = np.concatenate([block.samples for block in taken])
        found = np.abs(np.correlate(stream, burst.samples, "valid"))
        return {
            "outcome": report.outcome.value,
            "slip": report.start - burst.start,
            "found_at": taken[0].index + int(found.argmax()) - report.start,
            "gain": float(found.max() / np.vdot(burst.samples, burst.samples).real),
            "counters": radio.counters,
        }


if __name__ == "__main__":
    sys.stdout.write("\n" + json.dumps(asyncio.run(hear_a_burst())) + "\n")
