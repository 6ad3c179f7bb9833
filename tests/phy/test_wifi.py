"""802.11a frames: of a transmitter written from the standard, and the standard's own message."""

import numpy as np
import pytest

from phy.wifi import RATES, receive
from tests.phy.ht_frames import high_throughput_frame
from tests.phy.signals import noise, noisy, silence, turned
from tests.phy.wifi_frames import frame, with_fcs

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
    """Octets of 16-bit samples, weak, off the middle, with the radio's own offset."""
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


def test_a_high_throughput_frame_is_not_taken_for_one_of_ours():
    """802.11n begins as 802.11a does; what follows its SIGNAL is another code."""
    rng = np.random.default_rng(SEED)
    x = np.concatenate((silence(100), high_throughput_frame(psdus(rng, 1)[0]), silence(99)))
    assert not any(each.is_right for each in receive(noisy(rng, x, 25)))
