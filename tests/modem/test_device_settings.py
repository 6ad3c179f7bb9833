"""Each key of `[soapy]` reaches the device."""

from random import Random

import msgspec
import pytest

from backends import SoapyParams, SoapyRadio
from sdrlinkd.config import Config, ModemParams
from sdrlinkd.modem import make_radio

OTHERS = {
    "device": "driver=hackrf", "tx_enabled": True, "tx_gain_db": 7.0, "rx_gain_db": 8.0,
    "tx_gains": {"VGA": 3.0}, "rx_gains": {"LNA": 4.0}, "tx_antenna": "TX/RX", "rx_antenna": "RX2",
    "channel": 1, "bandwidth_hz": 2e6, "offset_tuning": "on", "dc_block": False, "ppm": 7.5,
    "clock_source": "external", "stream_args": {"num_recv_frames": "64"}, "settings": {"a": "b"},
    "lead_s": 0.03, "turnaround_s": 0.04, "transfers_in_flight": 5, "leading_transfers": 2,
    "listen_s": 0.06, "longest_tx_s": 0.7,
}  # fmt: skip


def test_each_key_is_tried():
    assert set(OTHERS) == set(SoapyParams.__struct_fields__)
    for key, value in msgspec.structs.asdict(SoapyParams()).items():
        assert OTHERS[key] != value, key


@pytest.mark.parametrize("key", OTHERS)
def test_what_is_configured_reaches_the_device(key, monkeypatch):
    made = []
    monkeypatch.setattr(SoapyRadio, "__init__", lambda _, *given: made.append(given))
    config = Config(
        backend="soapy",
        soapy=SoapyParams(**{key: OTHERS[key]}),
        modem=ModemParams(frequency_hz=868e6),
    )
    make_radio(config, 1, Random(0), 0.1)
    ((settings, *_),) = made
    assert msgspec.structs.asdict(settings) == {
        **msgspec.structs.asdict(SoapyParams()), "rate_hz": 5e6, "frequency_hz": 868e6,
        "block_s": 0.001, key: OTHERS[key],
    }  # fmt: skip
