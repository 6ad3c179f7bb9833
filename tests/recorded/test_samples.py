"""Third-party samples and codewords."""

import json
from fractions import Fraction

import numpy as np
import pytest

from phy.testing import QuasiCyclic, Segmentation, ldpc
from phy.wifi import HtFrame, HtSignal, WifiFrame, receive
from tests.phy.quiet import quiet


def samples(path):
    """A recording as complex samples at full scale 1."""
    if path.suffix == ".cf32":
        return np.fromfile(path, np.complex64)
    if path.suffix == ".i16":
        return (np.fromfile(path, "<i2").astype(np.float32) / 32768).view(np.complex64)
    return ((np.fromfile(path, np.uint8).astype(np.float32) - 127.5) / 127.5).view(np.complex64)


@pytest.mark.parametrize("network", [0, None])
@pytest.mark.parametrize(
    ("name", "wifi"),
    [
        ("adsb_modes1_2M.u8", False),
        ("gps_l1_noise_4M.cf32", False),
        ("futuresdr_wlan_bpsk_1-2_15db.cf32", True),
        ("wifi_11a_6mbps_conducted_20M.i16", True),
        ("wifi_11a_24mbps_conducted_20M.i16", True),
        ("wifi_11n_26mbps_radiated_20M.i16", True),
    ],
)
def test_nothing_of_ours_is_heard_in_recordings_of_others(data, name, wifi, network):
    counters = quiet(samples(data / "iq" / name), network)
    assert counters["triggers"] > 0 or not wifi
    assert counters["preambles"] == counters["headers_bad"] == 0
    assert counters["bursts"] == counters["bursts_foreign"] == 0


@pytest.mark.parametrize(("name", "mbps"), [("6mbps", 6), ("24mbps", 24)])
def test_frames_from_an_access_point_have_the_right_fcs(data, name, mbps):
    """Sent by independent hardware, and recorded by third parties over a cable."""
    frames = list(receive(samples(data / f"iq/wifi_11a_{name}_conducted_20M.i16")))
    assert all(each.is_right and each.rate.mbps == mbps for each in frames)
    data_frames = [each.psdu for each in frames if len(each.psdu) == 138]
    assert len(data_frames) >= 8
    ends = {bytes.fromhex("e4907e152a16"), bytes.fromhex("e8de27906e42")}
    assert all({psdu[4:10], psdu[10:16]} == ends for psdu in data_frames)


def test_frames_of_another_receiver_are_read(data):
    frames = list(receive(samples(data / "iq/futuresdr_wlan_bpsk_1-2_15db.cf32")))
    assert frames
    assert all(each.is_right and each.rate.mbps == 6 for each in frames)


def test_frames_of_802_11n_on_the_air_are_told_and_those_beside_them_read(data):
    """MCS 3 is 26 Mbit/s; the block acknowledgements in between are 802.11a."""
    frames = list(receive(samples(data / "iq/wifi_11n_26mbps_radiated_20M.i16")))
    ht = [each for each in frames if isinstance(each, HtFrame)]
    assert sum(each.signal == HtSignal(3, 138, False) for each in ht) == 5
    assert all(each.is_right for each in frames if isinstance(each, WifiFrame))
    assert len(frames) - len(ht) == 5


def test_codewords_made_elsewhere_are_ours(data):
    seen = set()
    for each in json.loads((data / "golden/ldpc_80211n_codewords.json").read_text()):
        code = QuasiCyclic(each["n"] // 24, Fraction(each["k"], each["n"]))
        word = np.unpackbits(np.frombuffer(bytes.fromhex(each["codeword_hex"]), np.uint8))[: code.n]
        form = Segmentation(code, code.k, 1, code.n)
        assert np.array_equal(ldpc.encode(word[None, : code.k].copy(), form)[0], word)
        seen.add((code.n, code.rate))
    assert len(seen) == 12
