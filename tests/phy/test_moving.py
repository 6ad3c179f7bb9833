"""A channel that moves within a burst, and steps of gain: what is lost, and how soon it is over."""

import numpy as np
import pytest
from scipy.special import erfc

from benchmarks.trials import Air, bursts, lost_of
from phy import OFDM_64_16, Modulation, PduHeard, Receiver, Transmitter, points, reference
from phy.kernels import equalise, start_tracking
from phy.testing import (
    DRIFT,
    DUE,
    MOVES,
    PHASE,
    axes,
    in_planes,
    new_scratch,
    order,
    polarity,
    tones,
)
from tests.phy.channels import both_estimates, trained
from tests.phy.signals import heard, noise, noisy, payloads, silence

SEED = 97
GRID = OFDM_64_16


@pytest.mark.parametrize(
    ("rate_hz", "doppler_hz", "n_pdus", "size", "n", "most"),
    [
        (5e6, 100.0, 1, 1500, 60, 0.06),
        (5e6, 200.0, 1, 1500, 60, 0.12),
        (1e6, 40.0, 4, 220, 100, 0.05),
        (1e6, 100.0, 1, 220, 300, 0.08),
    ],
)
@pytest.mark.slow
def test_pdus_are_heard_while_the_channel_moves(rate_hz, doppler_hz, n_pdus, size, n, most):
    """Several times the share that `benchmarks.rough` measures with many bursts is allowed."""
    air = Air(rate_hz=rate_hz, profile="tdl-a", doppler_hz=doppler_hz)
    lost = lost_of(air, bursts(air, 1, size, 25.0, SEED, n_pdus), n, n * n_pdus)
    assert lost.share <= most, lost


@pytest.mark.parametrize(
    ("rate_hz", "doppler_hz", "least", "most"),
    [(1e6, 0.0, 0, 5), (1e6, 40.0, 25, 55), (5e6, 0.0, 0, 25), (5e6, 200.0, 120, 260)],
)
def test_the_last_pdu_of_a_burst_tells_the_doppler(rate_hz, doppler_hz, least, most):
    air, squares = Air(rate_hz=rate_hz, profile="tdl-a", doppler_hz=doppler_hz), []
    receiver = Receiver(max_frequency=0.1)
    for _, (_, x) in zip(range(60), bursts(air, 1, 220, 25.0, SEED, 4), strict=False):
        heard_pdus = [each for each in receiver.push(x) if isinstance(each, PduHeard)]
        assert all((each.doppler is not None) == (each.number == 3) for each in heard_pdus)
        squares += [(each.doppler * rate_hz) ** 2 for each in heard_pdus if each.number == 3]
    assert len(squares) > 50
    assert least <= np.sqrt(np.mean(squares)) <= most


def test_the_reference_hears_them_too():
    air = Air(rate_hz=1e6, profile="tdl-a", doppler_hz=100.0)
    receiver, got, sent = reference.Receiver(max_frequency=0.1), [], []
    for _, (pdus, x) in zip(range(8), bursts(air, 1, 220, 25.0, SEED), strict=False):
        sent += pdus
        got += heard(receiver.push(x))
    got += heard(receiver.flush())
    assert len(set(sent) & set(got)) >= 7


@pytest.mark.parametrize(("step_db", "most"), [(-6, 0.02), (-3, 0), (-1, 0), (3, 0), (6, 0)])
def test_a_step_of_gain_costs_at_most_the_symbol_it_falls_in(step_db, most):
    """Two codewords make a PDU, and a symbol has more of one than parity can restore."""
    rng, receiver, lost = np.random.default_rng(SEED), Receiver(), 0
    for _ in range(50):
        pdus = payloads(rng, 4, 220)
        burst = Transmitter().modulate(pdus, 6).copy()
        burst[int(rng.integers(600, len(burst) - 200)) :] *= np.float32(10 ** (step_db / 20))
        x = noisy(rng, np.concatenate((silence(300), burst, silence(1000))), 25)
        events = receiver.push(x)
        lost += len(set(pdus) - {event.data for event in events if isinstance(event, PduHeard)})
    assert lost <= most * 200


class Followed:
    """The kernel's channel, as QPSK symbols through gains `h` `[n_used]` and noise correct it."""

    def __init__(self, no=0.003, seed=SEED, turn=0.0):
        self.rng, self.no, self.number = np.random.default_rng(seed), no, 2
        self.phase, self.turn = 0.0, turn
        y, sent, self.h = trained(self.rng, GRID, no, 4)
        self.block, _ = both_estimates(GRID, y, sent)
        self.channel, self._scratch = self.block.content, new_scratch(GRID).content
        start_tracking(tones(GRID).content, self.channel, 0.0, False)

    def hear(self, n, power=None):
        """The share of wrong bits in each of `n` symbols, with noise of that power if given."""
        wrong = []
        for _ in range(n):
            coded = self.rng.integers(0, 2, 2 * GRID.n_data, np.uint8)
            y = np.empty(GRID.n_used, np.complex128)
            y[GRID.data_at] = points(Modulation.QPSK)[coded.reshape(-1, 2) @ [2, 1]]
            y[GRID.pilots_at] = polarity(1, self.number)[0] * GRID.pilot_values
            self.phase += self.turn
            y = y * self.h * np.exp(1j * self.phase) + noise(
                self.rng, GRID.n_used, power or self.no
            )
            llr, shown = np.empty(len(coded), np.int16), np.empty((0, GRID.n_data), np.complex64)
            how = tones(GRID).content, axes(Modulation.QPSK, GRID).content
            planes = in_planes(y[None, GRID.tones].astype(np.complex64))
            equalise(planes, 1, self.number, *how, self.channel, self._scratch, shown, llr, 0)
            wrong.append(np.mean((llr < 0) != coded[order(len(coded), 2)]))
            self.number += 1
        return wrong


def test_a_channel_that_stands_still_again_is_believed_to():
    """Its drift falls by a factor of e in 80 symbols, and it is corrected every 8 symbols again.

    A subcarrier that was decided a quadrant off in a null stays so until the next burst.
    """
    due, worse = [], []
    for more in range(5):
        followed = Followed(seed=SEED + more)
        followed.hear(40)
        assert followed.channel.figures[DUE] == 8
        echo = 0.4 * followed.h * np.exp(0.3j * GRID.used)
        rest = followed.h - echo
        for i in range(30):
            followed.h = rest + echo * np.exp(0.02j * i)
            followed.hear(1)
        drift = followed.channel.figures[DRIFT]
        assert drift > 1e-6
        assert followed.channel.figures[DUE] < 8
        followed.hear(160)
        assert followed.channel.figures[DRIFT] < drift * np.exp(-1)
        followed.hear(550)
        known = erfc(np.abs(followed.h[GRID.data_at]) / np.sqrt(2 * followed.no)) / 2
        worse.append(np.mean(followed.hear(50)) - np.mean(known))
        due.append(followed.channel.figures[DUE])
    # What looks like movement by chance may make one begin again.
    assert np.median(due) == 8
    assert np.median(worse) < 0.002


@pytest.mark.parametrize("turn", [0.0, 0.004])
def test_a_channel_that_stands_still_is_seldom_taken_to_move(turn):
    """Neither an offset that is left nor the phase filter's own jitter counts as movement."""
    moves = []
    for more in range(8):
        followed = Followed(turn=turn, seed=SEED + more)
        followed.hear(100)
        for _ in range(100):
            followed.hear(1)
            moves.append(followed.channel.figures[MOVES])
        if not moves[-1]:
            assert followed.channel.tracking[PHASE, 1] == pytest.approx(turn, abs=2e-3)
    assert np.mean(moves) < 0.45


def test_a_burst_of_interference_is_over_with_its_last_symbol():
    """Even as strong as the signal, on pilots and all."""
    followed = Followed()
    followed.hear(24)
    followed.hear(6, power=1.0)
    assert np.mean(followed.hear(4)) < 0.05
    assert np.mean(followed.hear(40)) < 0.01


def test_a_channel_that_jumps_is_learned_anew():
    """Pilots that disagree alike in each symbol mean movement: no block is skipped for ever."""
    followed = Followed()
    followed.hear(24)
    followed.h = followed.h * 0.7 * np.exp(2.2j)
    followed.hear(60)
    assert np.mean(followed.hear(40)) < 0.05
