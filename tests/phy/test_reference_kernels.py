"""Each kernel of the receiver against the function of the reference that computes the same.

What single precision rounds, and what a kernel leaves out on purpose, is all that may part them.
Further kernels are compared where their own tests are: detector and modulator in `test_kernels`,
FFT and demapper in `test_lanes`, LDPC in `test_ldpc`, training in `test_training`, the K=7 code in
`test_coding`.
"""

import numpy as np
import pytest
from numba import njit

from phy import GRIDS, OFDM_64_16, Modulation, Transmitter, acquisition, header, preamble
from phy.estimation import in_planes, new_channel, new_scratch, tones
from phy.kernels import acquisition as kernel
from phy.kernels import equaliser as equaliser_kernel
from phy.kernels import tracking as tracking_kernel
from phy.kernels.burst import DELAY, DRIFT, GAIN, NO, SLOPE_USED
from phy.kernels.demodulator import slip
from phy.kernels.detector import search, strongest
from phy.kernels.smoothing import follow
from phy.kernels.timing import locate
from phy.kernels.tracking import PHASE, SLOPE
from phy.kernels.training import estimate, learn
from phy.mapping import axes
from phy.reference import acquisition as plain_acquisition
from phy.reference import detection, mapping, ofdm, offset, smoothing, timing, training
from phy.reference.channel import Channel
from phy.reference.equaliser import BLOCK, Equaliser
from phy.reference.header import folded, parse_header
from phy.reference.tracking import Tracking
from phy.sequences import polarity
from tests.phy.signals import noise, silence, turned

SEED = 79

every_grid = pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
every_modulation = pytest.mark.parametrize("modulation", Modulation)


def rng(more=0):
    return np.random.default_rng(SEED + more)


def planes_of(x):
    return np.stack((x.real, x.imag)).astype(np.float32)


def gains_of(channel, grid):
    """A kernel's gains in the order of `grid.used`."""
    h = np.empty(grid.n_used, np.complex128)
    h[grid.tones] = (channel.h[0] + 1j * channel.h[1])[: grid.n_used]
    return h


def in_tones(y, grid):
    """Symbols `[n, n_used]` as kernels take them."""
    return in_planes(y[:, grid.tones].astype(np.complex64))


def echoed(draws, grid, n_echoes=3):
    """Gains of a channel with some echoes, of mean power 1 or so."""
    delays = draws.uniform(0, grid.n_cp / 2, n_echoes)
    gains = noise(draws, n_echoes, 1 / n_echoes)
    return np.exp(-2j * np.pi * grid.used[:, None] * delays / grid.n_fft) @ gains


def assert_same(channel, other, grid, error=2e-4):
    """A kernel's channel and the reference's are the same."""
    power = other.gain + other.no
    assert gains_of(channel, grid) == pytest.approx(other.h, abs=error * np.sqrt(power))
    assert channel.figures[NO] == pytest.approx(other.no, rel=2e-3)
    assert channel.figures[GAIN] == pytest.approx(other.gain, rel=2e-3, abs=1e-6 * power)
    assert channel.figures[DRIFT] == pytest.approx(other.drift, rel=0.02, abs=1e-5)
    assert channel.unknown == pytest.approx(other.unknown, rel=0.02, abs=0.01 * other.no)
    assert channel.power == pytest.approx(other.power, rel=0.01, abs=1e-3 * power)


def searched(x, at, excess=0.0, dc=0j, n_seen=0):
    """(index of the first crossing or None, DC, hops seen) by the kernel, hop by hop."""
    state, work = np.array([dc.real, dc.imag, n_seen]), np.zeros((7, 191 + 512), np.float32)
    n_hops = (len(x) - 191) // 512
    found = search(x, n_hops, 512, detection.THRESHOLD, excess, 0, state, work)
    return (at - 191 + found if found >= 0 else None), complex(state[0], state[1])


@pytest.mark.parametrize("alarms", [0, 2])
@pytest.mark.parametrize("snr_db", [-3, 3, 20])
def test_the_search_crosses_at_the_same_sample(snr_db, alarms):
    for lead in (300, 1100, 2047):
        draws = rng(lead)
        x = noise(draws, 191 + 8 * 512, 10 ** (-snr_db / 10)) + np.complex64(0.1 - 0.05j)
        x[191 + lead :][:352] += preamble.preamble()
        detector, at, crossed = detection.Detector(0), 0, None
        for _ in range(alarms):
            detector.was_nothing(0)
        while crossed is None and at < 8 * 512:
            crossed, at = detector.crossing(x[at : at + 191 + 512], at), at + 512
        found, dc = searched(x, 0, min(alarms * detection.WARIER, 0.25))
        assert found == crossed
        assert dc == pytest.approx(detector.dc, abs=1e-6)
        assert crossed is not None or snr_db < 0


@pytest.mark.parametrize("kind", ["preamble", "noise", "level", "silence"])
def test_the_peak_and_its_frequency_are_the_same(kind):
    draws = rng()
    x = {
        "preamble": np.concatenate((silence(150), turned(preamble.preamble(), 0.0213))),
        "level": np.ones(600, np.complex64) * np.complex64(3 + 1j),
    }.get(kind, silence(600))[: 191 + 192]
    if kind != "silence":
        x = x + noise(draws, len(x), 0.05)
    best, p, plain = strongest(x, 192, 0j, np.zeros((7, 191 + 192), np.float32))
    where, frequency = detection.Detector(0).strongest(x)
    assert where == best
    assert (frequency is None) == (plain > detection.PLAINEST)
    assert frequency is not None or kind != "preamble"
    if frequency is not None:
        assert frequency == pytest.approx(np.angle(p) / (2 * np.pi * 16), abs=1e-5)


@every_grid
@pytest.mark.parametrize("max_frequency", [0.02, 0.1])
def test_the_long_training_is_located_at_the_same_sample(grid, max_frequency):
    shifted = timing.templates(grid, max_frequency)
    n_found = 0
    for seed in range(20):
        draws = rng(seed)
        reach = len(shifted) // 2
        frequency = draws.integers(-reach, reach + 1) / 16 + draws.uniform(-1e-3, 1e-3)
        span = 2 * timing.SEARCH + 2 * grid.n_fft
        x = noise(draws, span, 10 ** draws.uniform(-3, 0.5))
        if seed % 4:
            at = int(draws.integers(0, 2 * timing.SEARCH))
            for delay, gain in ((0, 0.5), (3, 0.8j), (9, 0.3)):
                sent = gain * turned(np.tile(preamble.long_symbol(grid), 2), frequency)
                x[at + delay :][: len(sent)] += sent[: max(0, span - at - delay)]
        early, told = locate(planes_of(x), shifted.astype(np.complex64))
        found = timing.locate(x.astype(np.complex128), shifted)
        assert (early < 0) == (found is None)
        if found is not None:
            n_found += 1
            assert early == found[0]
            assert told == pytest.approx(found[1], abs=1e-6)
    assert 6 <= n_found < 20


@every_grid
def test_the_likeliest_offset_is_the_same(grid):
    table = acquisition._training(grid, 0).content
    for seed in range(8):
        draws = rng(seed)
        h = echoed(draws, grid)
        z = turned(preamble.preamble(grid), draws.uniform(-1e-3, 1e-3))
        z = np.concatenate((silence(offset.BACKOFF), z)) + noise(draws, len(z) + 3, 0.3)
        # The parcel holds the room's arrays; it must outlive them.
        parcel = acquisition._new_room(grid)
        parcel.content.planes[:, : len(z)] = planes_of(z)
        found = kernel.refine(table, in_tones(h[None], grid)[0], parcel.content)
        assert offset.refine(z.astype(np.complex128), h, grid) == pytest.approx(found, abs=1e-7)


def trained(draws, grid, no, n=2, amplitude=None):
    """(symbols received, sent, gains) of `n` symbols of ±1."""
    sent = draws.choice([-1.0, 1.0], (n, grid.n_used)).astype(np.complex64)
    h = echoed(draws, grid)
    y = (np.ones(n) if amplitude is None else amplitude)[:, None] * h * sent
    return y + noise(draws, n * grid.n_used, no).reshape(n, -1), sent, h


def both_estimates(grid, y, sent):
    """(the kernel's channel, its parcel, the reference's) from known symbols."""
    parcel, scratch = new_channel(grid), new_scratch(grid)
    table, n = tones(grid).content, len(sent)
    known = in_tones(sent, grid), np.ones(n, np.float32)
    estimate(in_tones(y, grid), known[1], known[0], table, parcel.content, scratch.content)
    return parcel, training.estimate(y, sent, np.ones(n), grid)


@every_grid
@pytest.mark.parametrize("no", [1.0, 0.03, 1e-4])
def test_the_channel_that_training_tells_is_the_same(grid, no):
    for seed in range(5):
        y, sent, _ = trained(rng(seed), grid, no)
        parcel, other = both_estimates(grid, y, sent)
        assert_same(parcel.content, other, grid)
        assert parcel.content.figures[DELAY] == pytest.approx(other.delay, abs=1e-4)


@every_grid
@pytest.mark.parametrize("boost", [0.8, 1.0, 1.41, 5.0])
def test_what_a_header_tells_besides_is_the_same(grid, boost):
    for seed in range(4):
        amplitude = np.array([boost, boost, 1, 1])
        y, sent, _ = trained(rng(seed), grid, 0.02, 4, amplitude)
        parcel, before = both_estimates(grid, y[:2], sent[:2])
        rotation = 0.3 + 0.1 * np.arange(2)
        y[2:] *= np.exp(1j * rotation)[:, None]
        learn(
            in_tones(y, grid), in_tones(sent, grid), 2, rotation[-1], 0.1,
            tones(grid).content, parcel.content, new_scratch(grid).content,
        )  # fmt: skip
        assert_same(parcel.content, training.learn(y, sent, 2, rotation, before, grid), grid)


@every_grid
def test_a_channel_that_moves_is_followed_alike(grid):
    """Ten corrections: first noise, then a step, then noise again."""
    draws, scratch = rng(), new_scratch(grid).content
    y, sent, _ = trained(draws, grid, 0.02)
    parcel, channel = both_estimates(grid, y, sent)
    for number in range(10):
        error = noise(draws, grid.n_used, 0.005) + (0.3 if number == 4 else 0)
        follow(in_tones(error[None], grid)[0], 0.005, tones(grid).content, parcel.content, scratch)
        smoothing.follow(error, 0.005, channel, grid)
        assert_same(parcel.content, channel, grid)
    assert channel.drift > 0


@njit
def _predict(tracking):
    tracking_kernel.predict(tracking)


@njit
def _correct(turned_by, power, carriers, no, tracking):
    return tracking_kernel.correct(turned_by, power, carriers, no, tracking)


def state_of(kalman):
    """Value, rate, their variances and covariance, as the kernel has them."""
    (value, cov), (_, rate) = kalman.covariance
    return [*kalman.state, value, cov, rate]


@every_grid
@pytest.mark.parametrize("clock_error", [None, 1.7e-5])
def test_pilots_are_tracked_alike(grid, clock_error):
    """Through a turn, a lean, a symbol that others hit, one without power, pilots all of noise."""
    draws = rng()
    parcel, channel = both_estimates(grid, *trained(draws, grid, 0.02)[:2])
    told = clock_error is not None
    # The kernel's own channel, so that nothing else parts them.
    channel.no, channel.gain = parcel.content.no, parcel.content.gain
    equaliser_kernel.start_tracking(tones(grid).content, parcel.content, clock_error or 0.0, told)
    ours, other = parcel.content.tracking, Tracking(grid, channel, clock_error)
    carriers = grid.used[grid.pilots_at]
    for number in range(40):
        _predict(ours)
        other.predict()
        angle = 0.02 * number + 1e-3 * number * carriers / grid.n_fft
        angle = angle - ours[PHASE, 0] - ours[SLOPE, 0] * carriers
        weight = draws.uniform(0.2, 2, len(carriers))
        came = weight * np.exp(1j * angle) + noise(draws, len(carriers), 0.02)
        came = came * (number != 7) + noise(draws, len(carriers), 3.0) * (number == 20)
        came = came.astype(np.complex128)
        shown = _correct(came, weight, carriers, channel.no, ours)
        assert other.correct_by(came, weight, carriers, channel.no) == pytest.approx(shown)
        assert (shown > 6 * channel.no) == (number == 20)
        assert state_of(other.phase) == pytest.approx(ours[PHASE], rel=1e-6, abs=1e-12)
        assert state_of(other.slope) == pytest.approx(ours[SLOPE], rel=1e-6, abs=1e-15)
    slip(2, tones(grid).words, parcel.words)
    other.slip(2)
    assert other.slope.value == pytest.approx(ours[SLOPE, 0])


def equalised(grid, modulation, n, lean, no):
    """(the kernel's LLRs, points, channel; the reference's LLRs, points, equaliser).

    `n` symbols that turn, and that lean more and more, the last by `lean` radians a carrier.
    """
    draws, n_bits = rng(modulation.bits), grid.n_data * modulation.bits
    parcel, channel = both_estimates(grid, *trained(draws, grid, no)[:2])
    coded = draws.integers(0, 2, n * n_bits, np.uint8)
    # The same to the last bit: carriers in a fade would tell the difference.
    channel.h, channel.no, channel.gain = (
        gains_of(parcel.content, grid),
        *parcel.content.figures[:2],
    )
    y = mapping.to_carriers(coded, modulation, grid, 2) * channel.h
    angle = 0.01 * np.arange(n)[:, None] + lean / n * np.arange(n)[:, None] * grid.used
    y = y * np.exp(1j * angle)
    y[:, grid.data_at] += noise(draws, n * grid.n_data, no).reshape(n, -1)
    y = y.astype(np.complex64)
    equaliser_kernel.start_tracking(tones(grid).content, parcel.content, 0.0, False)
    llr, points = np.empty(n * n_bits, np.int16), np.empty((n, grid.n_data), np.complex64)
    equaliser_kernel.equalise(
        in_tones(y, grid), n, 2, tones(grid).content, axes(modulation, grid).content,
        parcel.content, new_scratch(grid).content, points, llr, 0,
    )  # fmt: skip
    equaliser = Equaliser(grid, channel, Tracking(grid, channel, None))
    made = [equaliser.equalise(each, 2 + i, modulation) for i, each in enumerate(y)]
    other = np.concatenate([each for each, _ in made]), np.array([each for _, each in made])
    return (llr, points, parcel.content), (*other, equaliser)


@every_modulation
@every_grid
@pytest.mark.parametrize("noise_share", [0.3, 0.03, 1e-3])
def test_symbols_are_equalised_alike(grid, modulation, noise_share):
    """A block of them, and the channel after it as both have learned it."""
    no = noise_share / modulation.bits**2
    ours, other = equalised(grid, modulation, BLOCK, 0.0, no)
    # Near a step of the quantiser, single precision decides.
    difference = np.abs(ours[0].astype(int) - other[0])
    assert difference.max() <= 1
    assert np.mean(difference > 0) < 0.01
    assert ours[1] == pytest.approx(other[1], abs=1e-5 * np.abs(other[1]).max())
    assert_same(ours[2], other[2].channel, grid)
    assert ours[2].tracking[PHASE, 0] == pytest.approx(other[2].tracking.phase.value, abs=1e-6)


@every_grid
def test_symbols_that_lean_are_equalised_alike(grid):
    """The kernel lets the slope lag by 0.01 rad at the outermost carriers, the reference not."""
    ours, other = equalised(grid, Modulation.QAM16, 3 * BLOCK, 0.3 / grid.n_fft, 1e-3)
    assert abs(ours[2].figures[SLOPE_USED]) > 0
    assert np.abs(ours[1] - other[1]).max() < 0.015 * np.abs(other[1]).max()
    slopes = ours[2].tracking[SLOPE, 0], other[2].tracking.slope.value
    assert grid.edge * slopes[0] == pytest.approx(grid.edge * slopes[1], abs=0.005)


@every_grid
@pytest.mark.parametrize("carrier_cycles", [0.0, 500.0])
def test_a_burst_is_acquired_alike(grid, carrier_cycles):
    """Start, offset, header, what is told of it, and the channel that its payload begins with."""
    ours = acquisition.Acquisition(grid, 0.1, carrier_cycles)
    other = plain_acquisition.Acquisition(grid, 0.1, carrier_cycles)
    n_read = n_missed = 0
    for seed in range(10):
        draws = rng(seed)
        burst = Transmitter(grid=grid).modulate([draws.bytes(20)], 3)
        x = np.concatenate((silence(24 + int(draws.integers(-9, 9))), burst))
        x = turned(x, draws.uniform(-0.01, 0.01) + (seed % 3 - 1) / 16)
        x = (x + noise(draws, len(x), 10 ** (-draws.uniform(-8, 25) / 10))).astype(np.complex64)
        coarse = draws.uniform(-0.002, 0.002)
        found, made = (each.acquire(x, 1000, coarse, 0.01j) for each in (ours, other))
        assert type(found).__name__ == type(made).__name__
        if isinstance(found, acquisition.Missed):
            n_missed += 1
            assert made == tuple(found)
            continue
        n_read += 1
        assert (made.header, made.origin, made.window) == (found.header, found.origin, found.window)
        assert made.frequency == pytest.approx(found.frequency, abs=1e-7)
        assert made.quality[:5] == found.quality[:5]
        assert made.quality[5:7] == pytest.approx(found.quality[5:7], abs=0.02)
        assert_same(found.channel.content, made.equaliser.channel, grid, 2e-3)
        tracked = found.channel.content.tracking
        assert made.equaliser.tracking.phase.value == pytest.approx(tracked[PHASE, 0], abs=1e-3)
    assert n_read >= 4
    assert n_missed >= 1


def test_headers_repetitions_are_folded_and_read_alike():
    """From clean to hopeless; many are read with the list's help only."""
    n_listed = n_read = 0
    for seed in range(120):
        draws = rng(seed)
        told = header.BurstHeader(*(int(draws.integers(1, most)) for most in (10, 64, 2048, 8)))
        coded = header.header_bits(told, 96)
        llr = 8 * (1 - 2.0 * coded) + draws.normal(0, draws.uniform(1, 16), 96)
        llr = np.clip(8 * llr, -511, 511).astype(np.int16)
        at_once = np.empty(76, np.int16)
        kernel.fold(llr, at_once)
        assert np.array_equal(folded(llr), at_once)
        likeliest = np.empty(4, np.uint8)
        kernel.decode_block(at_once, np.empty(38, np.uint64), likeliest)
        expected = header.parse_header(likeliest, at_once)
        assert parse_header(folded(llr)) == expected
        n_read += expected is not None
        n_listed += expected is not None and header._checked(likeliest.tobytes()) is None
    assert 20 < n_read < 120
    assert n_listed > 2


@every_grid
def test_a_carrier_sent_as_1_comes_back_as_1(grid):
    """The control of the reference itself: its FFT undoes its inverse FFT, with signs of pilots."""
    coded = rng().integers(0, 2, 5 * grid.n_data * 4, np.uint8)
    sent = mapping.to_carriers(coded, Modulation.QAM16, grid, 9)
    samples = ofdm.to_samples(sent, grid)
    assert np.mean(np.abs(samples) ** 2) == pytest.approx(1, abs=0.1)
    starts = grid.n_cp + grid.n_symbol * np.arange(5)
    assert ofdm.to_carriers(samples, starts, 0.0, 0j, grid) == pytest.approx(sent, abs=1e-12)
    pilots = sent[:, grid.pilots_at] * grid.pilot_values
    assert np.array_equal(pilots.real, np.repeat(polarity(5, 9)[:, None], pilots.shape[1], 1))
    # A window that begins within the prefix sees each carrier turned, and nothing else.
    early = ofdm.to_carriers(samples, starts - 3, 0.0, 0j, grid)
    lean = np.exp(-2j * np.pi * 3 * grid.used / OFDM_64_16.n_fft * 64 / grid.n_fft)
    assert early == pytest.approx(sent * lean, abs=1e-12)


def test_a_channel_has_noise_however_strong_it_is():
    assert Channel(np.ones(52), 1e-9, 2.0).noise == 2e-4
    assert Channel(np.ones(52), 0.1, 2.0).noise == 0.1
