"""802.11a frames: from a transmitter written after the standard, and the standard's own message."""

import numpy as np
import pytest

from phy.wifi import RATES, HtSignal, WifiFrame, receive
from tests.phy.signals import noise, noisy, silence, turned
from tests.phy.wifi_frames import frame, ht_frame, with_fcs

SEED = 53


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
    # Information about one frame does not leak into the next.
    assert last.psdu == psdu


@pytest.mark.slow
def test_a_frame_of_6_mbit_whatever_is_in_it_is_none_of_802_11n():
    rng = np.random.default_rng(SEED)
    sent = psdus(rng, 60)
    x = np.concatenate([np.concatenate((silence(300), frame(psdu, 6))) for psdu in sent])
    got = list(receive(noisy(rng, np.concatenate((x, silence(200))), 8)))
    assert [each.psdu for each in got if isinstance(each, WifiFrame)] == sent
    assert len(got) == len(sent)


# Annex G's message with the FCS that the standard prints (tables G.1, of 2007 and later).
MESSAGE = (
    bytes.fromhex("0402002e006008cd37a60020d6013cf1006008ad3baf0000")
    + b"Joy, bright spark of divinity,\nDaughter of Elysium,\nFire-insired we trea"
    + bytes.fromhex("673321b6")
)


def test_the_standards_own_message_is_read_with_its_fcs():
    assert with_fcs(MESSAGE[:-4]) == MESSAGE
    rng = np.random.default_rng(SEED)
    x = noisy(rng, np.concatenate((silence(100), frame(MESSAGE, 36), silence(99))), 30)
    assert [(each.psdu, each.is_right, each.rate.mbps) for each in receive(x)] == [
        (MESSAGE, True, 36)
    ]


@pytest.mark.parametrize("mbps", [6, 24])
def test_frames_as_a_radio_records_them_have_the_right_fcs(mbps):
    """As 16-bit samples, weak, off-centre, with the radio's own offset."""
    rng = np.random.default_rng(SEED)
    sent = [with_fcs(rng.bytes(134)) for _ in range(8)]
    parts = [silence(300)]
    for psdu in sent:
        x = turned(frame(psdu, mbps), rng.uniform(-0.002, 0.002), rng.random())
        parts += [x * 10 ** rng.uniform(-1.5, -0.5), silence(int(rng.integers(200, 900)))]
    x = np.concatenate(parts)
    x += noise(rng, len(x), 1e-5) + (2e-4 - 1e-4j)
    coarse = np.round(x.astype(np.complex64).view(np.float32) * 2000).astype("<i2")
    read = (coarse.astype(np.float32) / 32768).view(np.complex64)
    got = [(each.psdu, each.is_right, each.rate.mbps) for each in receive(read)]
    assert got == [(psdu, True, mbps) for psdu in sent]
