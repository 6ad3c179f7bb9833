"""802.11a frames: of a transmitter written from the standard, and recorded ones of others."""

from pathlib import Path

import numpy as np
import pytest

from phy.wifi import RATES, HtFrame, HtSignal, WifiFrame, receive
from tests.phy.signals import noise, noisy, silence, turned
from tests.phy.wifi_frames import frame, ht_frame, with_fcs

SEED = 53
RECORDINGS = Path(__file__).parents[2].parent / "shared/data/iq"

recorded = pytest.mark.skipif(not RECORDINGS.is_dir(), reason="no recordings beside the project")


def psdus(rng, n):
    return [with_fcs(rng.bytes(int(rng.integers(20, 400)))) for _ in range(n)]


@pytest.mark.parametrize("rate", RATES.values(), ids=lambda rate: str(rate.mbps))
def test_frames_of_every_rate_are_read(rate):
    rng = np.random.default_rng(SEED)
    sent = psdus(rng, 3)
    parts = [silence(300)]
    for psdu in sent:
        parts += [turned(frame(psdu, rate.mbps), 0.004, rng.random()), silence(500)]
    got = list(receive(noisy(rng, np.concatenate(parts), 30)))
    assert [(each.psdu, each.is_right, each.rate) for each in got] == [
        (psdu, True, rate) for psdu in sent
    ]
    for each in got:
        assert each.snr_db == pytest.approx(30, abs=1.5)
        assert each.cfo_hz == pytest.approx(0.004 * 20e6, abs=500)


def test_a_frame_through_echoes_is_read():
    rng = np.random.default_rng(SEED)
    psdu = psdus(rng, 1)[0]
    echoes = np.zeros(12, np.complex64)
    echoes[[0, 3, 11]] = 1, 0.6j, -0.4
    x = np.convolve(np.concatenate((silence(200), frame(psdu, 12), silence(99))), echoes)
    assert [each.psdu for each in receive(noisy(rng, x, 20))] == [psdu]


def test_a_wrong_octet_is_told_by_its_fcs():
    rng = np.random.default_rng(SEED)
    psdu = bytearray(psdus(rng, 1)[0])
    psdu[9] ^= 4
    x = np.concatenate((silence(100), frame(bytes(psdu), 24), silence(99)))
    got = list(receive(noisy(rng, x, 25)))
    assert [(each.psdu, each.is_right) for each in got] == [(bytes(psdu), False)]


def test_what_is_cut_or_no_frame_is_none():
    rng = np.random.default_rng(SEED)
    x = noisy(rng, np.concatenate((silence(100), frame(psdus(rng, 1)[0], 6))), 25)
    assert list(receive(x[:-200])) == []
    assert list(receive(x[:450])) == []
    assert list(receive(noise(rng, 200_000))) == []
    assert list(receive(silence(5000))) == []
    assert list(receive(silence(3))) == []


@pytest.mark.parametrize("greenfield", [False, True], ids=["mixed", "greenfield"])
@pytest.mark.parametrize(
    ("mcs", "n_bytes", "wide"), [(0, 1, False), (7, 65535, True), (76, 138, False)]
)
def test_frames_of_802_11n_are_told_as_such(greenfield, mcs, n_bytes, wide):
    rng = np.random.default_rng(SEED)
    parts = [silence(300)]
    for _ in range(3):
        sent = ht_frame(mcs, n_bytes, wide, greenfield)
        parts += [turned(sent, -0.003, rng.random()), silence(500)]
    psdu = psdus(rng, 1)[0]
    parts += [frame(psdu, 6), silence(200)]
    *got, last = receive(noisy(rng, np.concatenate(parts), 15))
    assert [(each.signal, each.is_greenfield) for each in got] == [
        (HtSignal(mcs, n_bytes, wide), greenfield)
    ] * 3
    for each in got:
        assert each.cfo_hz == pytest.approx(-0.003 * 20e6, abs=1000)
        assert each.snr_db == pytest.approx(15, abs=1.5)
    # What is said of one does not spill over to the next.
    assert last.psdu == psdu


def test_a_frame_of_6_mbit_whatever_is_in_it_is_none_of_802_11n():
    rng = np.random.default_rng(SEED)
    sent = psdus(rng, 60)
    x = np.concatenate([np.concatenate((silence(300), frame(psdu, 6))) for psdu in sent])
    got = list(receive(noisy(rng, np.concatenate((x, silence(200))), 8)))
    assert [each.psdu for each in got if isinstance(each, WifiFrame)] == sent
    assert len(got) == len(sent)


def read_i16(name):
    values = np.fromfile(RECORDINGS / name, "<i2").astype(np.float32) / 32768
    return values.view(np.complex64)


@recorded
@pytest.mark.parametrize(("name", "mbps"), [("6mbps", 6), ("24mbps", 24)])
def test_frames_from_an_access_point_have_the_right_fcs(name, mbps):
    """Made by hardware that knows nothing of us, recorded by others over a cable."""
    frames = list(receive(read_i16(f"wifi_11a_{name}_conducted_20M.i16")))
    assert all(each.is_right and each.rate.mbps == mbps for each in frames)
    data = [each.psdu for each in frames if len(each.psdu) == 138]
    assert len(data) >= 8
    ends = {bytes.fromhex("e4907e152a16"), bytes.fromhex("e8de27906e42")}
    assert all({psdu[4:10], psdu[10:16]} == ends for psdu in data)


@recorded
def test_frames_of_another_receiver_are_read():
    samples = np.fromfile(RECORDINGS / "futuresdr_wlan_bpsk_1-2_15db.cf32", np.complex64)
    frames = list(receive(samples))
    assert frames
    assert all(each.is_right and each.rate.mbps == 6 for each in frames)


@recorded
def test_frames_of_802_11n_on_the_air_are_told_and_those_beside_them_read():
    """MCS 3 is 26 Mbit/s; the block acknowledgements between them are 802.11a."""
    frames = list(receive(read_i16("wifi_11n_26mbps_radiated_20M.i16")))
    ht = [each for each in frames if isinstance(each, HtFrame)]
    assert sum(each.signal == HtSignal(3, 138, False) for each in ht) == 5
    assert all(each.is_right for each in frames if isinstance(each, WifiFrame))
    assert len(frames) - len(ht) == 5
