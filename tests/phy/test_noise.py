"""Gaussian noise from counters: its definition in double precision, and its statistics."""

import math

import numpy as np
import pytest

from phy.testing import NOISE_CHUNK as CHUNK
from phy.testing import compute

KEY = 0x0123456789ABCDEF


def made(n, key=KEY, first=0, scale=1.0, x=None):
    out = np.empty(2 * n, np.float32)
    x = np.zeros(2 * n, np.float32) if x is None else x.view(np.float32)
    bits, radii = np.empty(CHUNK, np.uint32), np.empty(CHUNK, np.float32)
    compute.add_noise(x, key, first, scale, bits, radii, out)
    return out.view(np.complex64)


def triple32(x):
    for shift, factor in ((17, 0xED5AD4BB), (11, 0xAC4C1B51), (15, 0x31848BAB)):
        x = ((x ^ (x >> shift)) * factor) & 0xFFFFFFFF
    return x ^ (x >> 14)


def splitmix64(z):
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        z = ((z ^ (z >> shift)) * factor) & 0xFFFFFFFFFFFFFFFF
    return z ^ (z >> 31)


def by_definition(index):
    chunk, offset = divmod(index, CHUNK)
    keys = splitmix64((KEY + chunk * 0x9E3779B97F4A7C15) & 0xFFFFFFFFFFFFFFFF)
    first, second = triple32(offset ^ (keys & 0xFFFFFFFF)), triple32(offset ^ (keys >> 32))
    u = ((first >> 1) + 1) / 2**31
    signed = second - 2**32 if second >= 2**31 else second
    angle = (signed >> 2) / 2**29 * math.pi / 4
    parts = (math.sin(angle), math.cos(angle)) if second & 1 else (math.cos(angle), math.sin(angle))
    return math.sqrt(-2 * math.log(u)) * complex(*parts) * (1 if second & 2 else -1)


def test_it_is_what_its_definition_says():
    got = made(3 * CHUNK)
    wanted = np.array([by_definition(i) for i in range(3 * CHUNK)])
    # ln u is the difference of two numbers near 31 ln 2, each accurate to 24 bits.
    error_of_ln = 31 * math.log(2) * 2**-23
    allowed = np.minimum(np.sqrt(2 * error_of_ln), error_of_ln / np.abs(wanted)) + 1e-6
    assert np.all(np.abs(got - wanted) < allowed)


def test_any_part_can_be_made_alone_and_adds_to_a_signal():
    whole = made(5000, first=700)
    x = made(5000, key=5)
    for begin, end in ((0, 1), (300, 2000), (1023, 1024), (4000, 5000)):
        part = made(end - begin, first=700 + begin, scale=2.0, x=x[begin:end].copy())
        assert part == pytest.approx(x[begin:end] + 2 * whole[begin:end], abs=1e-5)
    far = made(100, first=2**40)
    assert np.array_equal(far[60:], made(40, first=2**40 + 60))


@pytest.mark.slow
def test_it_is_gaussian_to_its_tails():
    n = 4_000_000
    for parts in made(n).view(np.float32).reshape(n, 2).T.astype(np.float64):
        for power, moment in ((1, 0), (2, 1), (3, 0), (4, 3), (6, 15)):
            values = parts**power
            assert abs(values.mean() - moment) < 4 * values.std() / math.sqrt(n)
        for sigmas in (0.5, 1, 2, 3, 4, 5):
            share = math.erfc(sigmas / math.sqrt(2))
            beyond = int(np.count_nonzero(np.abs(parts) > sigmas))
            assert abs(beyond - n * share) < 4 * math.sqrt(n * share) + 1


def test_it_is_white_within_and_between_keys():
    n = 1 << 20
    x = made(n)
    power = np.abs(np.fft.fft(x)) ** 2 / (2 * n)
    assert power.max() < 1.5 * math.log(n)
    assert abs(power.std() - 1) < 0.01
    echoes = np.abs(np.fft.ifft(power))[1:]
    assert echoes.max() < 6 / math.sqrt(n)
    for other in (made(n, key=KEY + 1), made(n, key=1), made(n, first=n)):
        assert abs(np.vdot(x, other)) / (2 * n) < 5 / math.sqrt(n)
