"""Lines and pulses are cut, nothing else is; and the receiver knows which lines were cut."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phy import (
    GRIDS,
    MCS_TABLE,
    N_PULSE,
    OFDM_64_16,
    EnergyDetector,
    Excisor,
    Jammer,
    Path,
    PathParams,
    PduHeard,
    Transmitter,
    pulse,
    reference,
)
from phy.engine import in_use
from phy.testing import compute, new_notch_memory, notch_tables
from tests.laws import law
from tests.phy.signals import heard, noise, noisy, payloads, silence

SIZE, STRIDE = notch_tables.SIZE, notch_tables.STRIDE
BLOCK = 64
RATE_HZ = 1e6
SETTLED = 20_000
"""Samples after which a line that stays is cut."""
GRID = OFDM_64_16
SEED = 47


@pytest.fixture
def rng():
    return np.random.default_rng(SEED)


def through(x, excisor=None, cuts=()):
    """The samples that an excisor hands on of `x`, pushed in pieces that end at `cuts`."""
    excisor = excisor or Excisor()
    parts = [excisor.push(each).copy() for each in np.split(x, cuts)]
    return np.concatenate((*parts, excisor.flush()))


def jammed(rng, x, kind, power_db, **settings):
    """`x`, SETTLED samples later, beside a jammer so far above a mean power of 1."""
    jammer = Jammer(kind, power_db, RATE_HZ, int(rng.integers(1 << 30)), **settings)
    return jammer.add(np.concatenate((noise(rng, SETTLED, 0.01), x)), 0)


def received(x, receiver, excisor=None):
    """The PDUs that a receiver hears behind an excisor."""
    excisor = excisor or Excisor()
    receiver.cuts = excisor.cuts
    return heard(receiver.push(excisor.push(x)) + receiver.push(excisor.flush()) + receiver.flush())


def a_stream(rng, n, size, mcs, snr_db, grid=GRID):
    """(PDUs, their bursts one after another, in noise)."""
    pdus = payloads(rng, n, size)
    transmitter = Transmitter(grid=grid)
    parts = [np.concatenate((silence(700), transmitter.modulate([each], mcs))) for each in pdus]
    return pdus, noisy(rng, np.concatenate((*parts, silence(3000))), snr_db)


def blanked(x):
    """Number of blocks of `x` in which there is a pulse."""
    n, found = len(x) // BLOCK - 1, np.zeros(len(x) // BLOCK, np.uint8)
    compute.blank(x.copy(), n, 0.0, np.empty(BLOCK, np.float32), found)
    return found.sum()


@pytest.mark.parametrize("profile", ["awgn", "rayleigh", "tdl-a", "tdl-c"])
@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
def test_in_clean_air_hardly_anything_is_cut(rng, grid, profile):
    """Each window is looked at, not only those that an excisor without lines looks at.

    Echoes lift a part of the spectrum, and leave holes in another; that makes no lines of it.
    """
    n, cut, found, n_windows, n_cut = 8, np.zeros((8, SIZE), np.uint8), np.zeros(8, int), 0, 0
    n_blanked = 0
    for mcs in MCS_TABLE:
        for snr_db in (0, 10, 40):
            waves = [Transmitter(grid=grid).modulate([rng.bytes(200)], mcs.index) for _ in range(4)]
            air = PathParams(rate_hz=5e6, profile=profile, delay_spread_s=1e-7)
            x = np.concatenate([np.pad(Path(air, rng).carry(wave)[1], 200) for wave in waves])
            x = noisy(rng, x.astype(np.complex64), snr_db)
            n_blanked += blanked(x)
            memory, out = new_notch_memory(), np.empty(n * STRIDE, np.complex64)
            for begin in range(0, len(x) - (n + 1) * STRIDE, n * STRIDE):
                piece = x[begin : begin + (n + 1) * STRIDE]
                compute.cut_lines(piece, n, memory, out, cut, found)
                n_windows += n
                n_cut += np.count_nonzero(found)
    assert n_cut <= 0.003 * n_windows
    assert n_blanked == 0


def test_windows_without_lines_are_left_as_they_are(rng):
    """Even their DC, once the lines are long gone: it has a part of what is near it."""
    _, x = a_stream(rng, 5, 400, 9, 40)
    memory, n = new_notch_memory(), 8
    out, cut, found = (
        np.empty(n * STRIDE, np.complex64),
        np.zeros((8, SIZE), np.uint8),
        np.zeros(8, int),
    )
    for begin in range(0, len(x) - (n + 1) * STRIDE, n * STRIDE):
        compute.cut_lines(x[begin : begin + (n + 1) * STRIDE], n, memory, out, cut, found)
        got, whole = out[STRIDE if begin == 0 else 0 :], x[begin : begin + n * STRIDE]
        assert np.allclose(got, whole[-len(got) :], atol=1e-4)


@pytest.mark.parametrize(
    ("kind", "power_db", "settings"),
    [
        ("tone", 0, {"offset_hz": 123e3}),
        ("tone", 40, {"offset_hz": -312e3}),
        ("tone", 20, {"offset_hz": 100.0}),
        ("tone", 20, {"offset_hz": 4e3}),
        ("tone", 20, {"offset_hz": -13e3}),
        ("narrow", 10, {"offset_hz": 200e3, "width_hz": 40e3}),
        ("sweep", 10, {"period_s": 0.01}),
    ],
)
def test_beside_a_jammer_bursts_are_heard(rng, kind, power_db, settings):
    pdus, x = a_stream(rng, 10, 64, 1, 15)
    x = jammed(rng, x, kind, power_db, **settings)
    assert received(x, in_use().receiver()) == pdus
    assert not heard(in_use().receiver().push(x))


def at_dc(t):
    return 10 * np.exp(1j) + 0 * t


def leaking(t):
    """An LO 20 dB stronger than the bursts, 10 Hz off."""
    return 10 * np.exp(2j * np.pi * 10 * t)


def two_that_move(t):
    """Two tones that swing through the band, and cross."""
    swing = 2e5 * np.sin(2 * np.pi * 25 * t)
    phases = [2 * np.pi * np.cumsum(f) / RATE_HZ for f in (1e5 + swing, -1e5 - swing)]
    return 10 * sum(np.exp(1j * phase) for phase in phases)


@pytest.mark.parametrize("hostile", [at_dc, leaking, two_that_move])
def test_beside_what_is_no_steady_line_bursts_are_heard(rng, hostile):
    pdus, x = a_stream(rng, 10, 64, 1, 15)
    x = np.concatenate((noise(rng, SETTLED, 0.03), x))
    x = (x + hostile(np.arange(len(x)) / RATE_HZ)).astype(np.complex64)
    assert received(x, in_use().receiver()) == pdus


@pytest.mark.parametrize(("length", "n_heard"), [(30, 9), (200, 0)])
def test_a_jammer_of_preambles_leaves_nothing_behind(rng, length, n_heard):
    """A short pulse in each of ten preambles is blanked; one as long as they are is not."""
    pdus, x = a_stream(rng, 20, 64, 1, 15)
    every = (len(x) - 3000) // 20
    for begin in range(800, 10 * every, every):
        x[begin : begin + length] += noise(rng, length, 100)
    got = received(np.concatenate((noise(rng, SETTLED, 0.03), x)), in_use().receiver())
    assert set(got) <= set(pdus)
    assert len(set(got) & set(pdus[:10])) >= n_heard
    assert got[-9:] == pdus[-9:]


@pytest.mark.parametrize("engine", ["in use", "reference"])
def test_subcarriers_that_were_cut_in_the_preamble_come_back(rng, engine):
    """A sweep is somewhere else with each burst, and at the edge of the band with some."""
    kind = reference.Receiver if engine == "reference" else in_use().receiver
    pdus, x = a_stream(rng, 1, 220, 1, 25)
    x = np.concatenate((noise(rng, SETTLED, 0.003), x))
    for place in range(0, 10_000, 500):
        sweep = Jammer("sweep", 10, RATE_HZ, place)
        assert received(sweep.add(x, place), kind()) == pdus


@pytest.mark.parametrize(
    ("power_db", "offset_hz"), [(0, 100.0), (0, 200.0), (0, 400.0), (40, 40.0), (40, 100.0)]
)
def test_a_tone_that_looks_like_dc_does_no_harm(rng, power_db, offset_hz):
    pdus, x = a_stream(rng, 10, 64, 1, 15)
    x = jammed(rng, x, "tone", power_db, offset_hz=offset_hz)
    assert received(x, in_use().receiver()) == pdus


@given(st.integers(0, 1 << 30), st.lists(st.integers(0, 60_000), max_size=8), st.integers(0, 3000))
def test_any_chunking_gives_the_same_samples(seed, cuts, gap):
    rng = np.random.default_rng(seed)
    settings = {"times": [(0.002, 0.02), (0.055, 0.058)], "offset_hz": rng.uniform(-4e5, 4e5)}
    jammer = Jammer("tone", rng.uniform(0, 40), RATE_HZ, seed, **settings)
    pulses = Jammer("pulses", 25, RATE_HZ, seed, period_s=rng.uniform(3e-4, 3e-3), duty=0.01)
    x = jammer.add(noise(rng, 60_000, 0.1) + np.complex64(rng.uniform(0, 2)), 0)
    x[30_000:] = pulses.add(x[30_000:], 30_000)
    late = jammer.add(noise(rng, 10_000, 0.1), len(x) + gap)
    whole, parts = Excisor(), Excisor()
    at_once = (whole.push(x).copy(), whole.gap(gap), whole.push(late).copy(), whole.flush())
    split = [parts.push(each).copy() for each in np.split(x, sorted(cuts))]
    others = (*split, parts.gap(gap), parts.push(late).copy(), parts.flush())
    assert len(np.concatenate(at_once)) == len(x) + len(late)
    assert np.array_equal(np.concatenate(at_once), np.concatenate(others))
    assert whole.counters == parts.counters


def test_a_constant_is_no_line(rng):
    x = noise(rng, 40_000) + np.complex64(10 - 3j)
    excisor = Excisor()
    assert np.array_equal(through(x, excisor), x)
    assert not excisor.counters["windows_notched"]


def test_half_of_the_band_is_not_cut(rng):
    spectrum = np.fft.fft(noise(rng, 40_000))
    spectrum[1_000:18_000] *= 30
    x, excisor = np.fft.ifft(spectrum).astype(np.complex64), Excisor()
    # Something narrow makes it look at each window.
    x[:20_000] += 1e4 * np.exp(-2j * np.pi * 0.2 * np.arange(20_000))
    more = through(x, excisor)[22_000:] - x[22_000:]
    # But DC, which is cut in every window.
    assert np.mean(np.abs(more) ** 2) < 0.02 * np.mean(np.abs(x[22_000:]) ** 2)
    assert excisor.counters["windows_not_notched"] > 10


def test_when_the_jammer_ends_all_is_left_again(rng):
    x, excisor = noise(rng, 90_000, 0.1), Excisor()
    jammer = Jammer("tone", 30, RATE_HZ, 1, offset_hz=1e5, times=[(0, 0.03)])
    out = through(jammer.add(x, 0), excisor)
    assert np.array_equal(out[30_000 + 66 * STRIDE :], x[30_000 + 66 * STRIDE :])
    assert excisor.counters["windows_notched"] < 30_000 / STRIDE


def test_beside_a_tone_the_channel_is_idle(rng):
    x = Jammer("tone", 20, RATE_HZ, 1, offset_hz=1e5).add(noise(rng, 200_000), 0)
    sense, excisor, busy = EnergyDetector(), Excisor(), []
    for each in np.split(x, 200):
        sense.push(excisor.push(each))
        busy.append(sense.busy_until == sense.next_index)
    assert sum(busy[50:]) <= 3


def test_a_robot_that_listens_for_moments_finds_lines(rng):
    """Half duplex: its own bursts make gaps in what it hears."""
    jammer, excisor, index = Jammer("tone", 20, RATE_HZ, 1, offset_hz=1e5), Excisor(), 0
    for _ in range(40):
        x = jammer.add(noise(rng, 1500), index)
        heard_of_it = np.concatenate((excisor.push(x).copy(), excisor.gap(2000)))
        index += 3500
    assert excisor.counters["windows_notched"] > 35 * 5
    assert np.mean(np.abs(heard_of_it[STRIDE:-STRIDE]) ** 2) < 1.5


@pytest.mark.parametrize("power_db", [17, 27, 60])
@pytest.mark.parametrize("period_s", [1e-3, 1.024e-3, 3.84e-4])
def test_beside_pulses_bursts_are_heard(rng, power_db, period_s):
    pdus, x = a_stream(rng, 10, 64, 1, 15)
    x = jammed(rng, x, "pulses", power_db, period_s=period_s, duty=2e-5 / period_s)
    assert received(x, in_use().receiver()) == pdus
    assert len(heard(in_use().receiver().push(x))) < 9


@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
def test_bursts_and_our_own_pulses_are_no_pulses(rng, grid):
    """Each block is looked at, not only those that an excisor without pulses looks at."""
    for mcs in MCS_TABLE:
        _, x = a_stream(rng, 1, 400, mcs.index, 40, grid)
        x[200 : 200 + N_PULSE] += pulse()
        assert not blanked(x)


def test_the_noise_of_a_coarse_converter_is_no_pulse(rng):
    """Its samples are mostly 0, the others a step; a burst stands out of it like any other."""
    for level in (0.02, 0.1, 0.3, 1):
        _, x = a_stream(rng, 1, 400, 1, 40)
        x = (
            np.round(x.view(np.float32) * 4 + level * rng.standard_normal(2 * len(x))) / 128
        ).astype(np.float32)
        assert not blanked(x.view(np.complex64))


def test_when_the_pulses_end_all_is_left_again(rng):
    x, excisor = noise(rng, 90_000, 0.1), Excisor()
    pulses = Jammer("pulses", 30, RATE_HZ, 1, period_s=1e-3, times=[(0, 0.03)])
    out = through(pulses.add(x, 0), excisor)
    assert np.array_equal(out[30_000:], x[30_000:])
    assert 20 < excisor.counters["pulses_blanked"] <= 2 * 30
    # Nothing waits any more.
    assert len(excisor.push(x)) == len(x)


def test_beside_pulses_the_channel_is_idle(rng):
    x = Jammer("pulses", 20, RATE_HZ, 1, period_s=1e-3).add(noise(rng, 200_000), 0)
    sense, excisor = EnergyDetector(), Excisor()
    for each in np.split(x, 10):
        sense.push(excisor.push(each))
    assert sense.busy_until < 20_000


def test_the_reference_cuts_the_same(rng):
    x = noise(rng, 9 * STRIDE, 0.1) + np.complex64(1)
    x = Jammer("narrow", 20, RATE_HZ, 1, offset_hz=1e5, width_hz=3e4).add(x, 0)
    made = []
    for kernels in (vars(reference)["KERNELS"], in_use().kernels):
        out, cut = np.empty(8 * STRIDE, np.complex64), np.zeros((8, SIZE), np.uint8)
        memory, found = new_notch_memory(), np.zeros(8, np.int64)
        kernels["cut_lines"](x, 8, memory, out, cut, found)
        lines = kernels["find_lines"](x, 2, 4 * STRIDE, new_notch_memory(), cut.copy())
        made.append((out, cut, found, lines, memory.content.tail))
    for a, b in zip(*made, strict=True):
        assert np.allclose(a, b, atol=1e-4)
    assert made[0][1].any()


def test_the_reference_blanks_the_same(rng):
    x = noise(rng, 17 * BLOCK, 0.1)
    x[200:220] += 5 * noise(rng, 20)
    x[319] += 30
    made, power = [], np.empty(BLOCK, np.float32)
    for kernels in (vars(reference)["KERNELS"], in_use().kernels):
        out, found = x.copy(), np.zeros(9, np.uint8)
        level = kernels["blank"](out, 9, 0.01, power, found)
        pulses = [kernels["find_pulses"](x[n : n + 8 * BLOCK], power) for n in (0, 9 * BLOCK)]
        made.append((out, found, round(level, 3), pulses))
    for a, b in zip(*made, strict=True):
        assert np.array_equal(a, b)
    assert made[0][1].sum() == 2


def test_what_was_cut_is_known_by_subcarrier(rng):
    excisor = Excisor()
    x = jammed(rng, noise(rng, 9_000, 0.01), "tone", 0, offset_hz=10.5 / 64 * RATE_HZ)
    through(x, excisor)
    starts = np.array([100, 15_000, 15_080])
    kept = excisor.cuts.kept(starts, 0.0, GRID)
    cut = [set(GRID.used[row == 0].tolist()) for row in kept]
    assert cut == [set(), {10, 11}, {10, 11}]
    moved = excisor.cuts.kept(starts[1:], 1 / 64, GRID)
    assert set(GRID.used[moved[0] == 0].tolist()) == {9, 10}
    assert excisor.cuts.kept(np.array([90_000]), 0.0, GRID) is None


def heard_knowing(x, engine):
    """How many PDUs are heard by a receiver that knows what was cut, and by one that does not."""
    kind, n_heard = reference.Receiver if engine == "reference" else in_use().receiver, []
    for knows in (True, False):
        receiver, excisor = kind(), Excisor()
        receiver.cuts = excisor.cuts if knows else None
        n_heard.append(len(heard(receiver.push(excisor.push(x)) + receiver.flush())))
    return n_heard


@pytest.mark.parametrize("engine", ["in use", "reference"])
def test_64qam_is_read_around_lines(rng, engine):
    """Without the knowledge of what was cut, most of these are lost."""
    _, x = a_stream(rng, 20, 220, 7, 25)
    for offset_hz in (-271e3, 83e3, 207e3):
        x = Jammer("tone", 5, RATE_HZ, 1, offset_hz=offset_hz).add(x, 0)
    knowing, without = heard_knowing(np.concatenate((x[:SETTLED], x)), engine)
    assert knowing >= 10
    assert without <= 5


@pytest.mark.parametrize("engine", ["in use", "reference"])
def test_64qam_is_read_around_pulses(rng, engine):
    """Without the knowledge of what was blanked, most of these are lost."""
    _, x = a_stream(rng, 20, 220, 5, 28)
    x = jammed(rng, x, "pulses", 17, period_s=3e-4, duty=0.05)
    knowing, without = heard_knowing(x, engine)
    assert knowing >= 13
    assert without <= 7


def test_the_snr_that_is_told_of_pdus_beside_pulses_does_not_depend_on_their_mcs(rng):
    """So that rate control does not go down and down. Without them, it is that of the burst."""
    told = []
    for mcs in (1, 3, 5):
        _, x = a_stream(rng, 30, 220, mcs, 28)
        clear = [event for event in in_use().receiver().push(x) if isinstance(event, PduHeard)]
        # Pilots differ by chance, and where peaks were clipped.
        assert np.mean([each.burst.snr_db - each.snr_db for each in clear]) < 0.5
        x = jammed(rng, x, "pulses", 17, period_s=3e-4, duty=0.05)
        receiver, excisor = in_use().receiver(), Excisor()
        receiver.cuts = excisor.cuts
        events = receiver.push(excisor.push(x))
        told.append(np.mean([each.snr_db for each in events if isinstance(each, PduHeard)]))
        bursts = [each.burst.snr_db for each in events if isinstance(each, PduHeard)]
        assert np.mean(bursts) == pytest.approx(28, abs=0.5)
    assert max(told) < 24
    assert max(told) - min(told) < 1


@law(100)
@given(st.lists(st.integers(0, 9 * BLOCK - 1)), st.lists(st.integers(0, 8 * BLOCK), min_size=1))
def test_what_was_blanked_is_known_by_symbol(samples, starts):
    blank, cuts = np.zeros(9 * BLOCK, bool), Excisor().cuts
    blank[samples] = True
    for block in range(9):
        if blank[block * BLOCK : (block + 1) * BLOCK].any():
            cuts.blank(block, blank[block * BLOCK : (block + 1) * BLOCK])
    starts.sort()
    for grid in GRIDS.values():
        lost = [blank[each : each + grid.n_fft].sum() for each in starts]
        whole = cuts.whole(np.array(starts), grid)
        due = np.maximum(grid.n_fft - np.array(lost), 1) / grid.n_fft
        assert np.allclose(1 if whole is None else whole, due)


def test_impossible_gaps_are_refused():
    with pytest.raises(ValueError, match="gap: got -1 samples"):
        Excisor().gap(-1)
