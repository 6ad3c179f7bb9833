"""White Gaussian noise: sample n is a function of a key and of n, so any chunk can be made alone.

The method is Box and Muller's: radius sqrt(-2 ln u) and a uniform angle. The random numbers are
hashed counters instead of a running state, and both functions are polynomials, so every loop is
vectorised.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.sizes import NOISE_CHUNK as CHUNK

_U32, _U64, _F32, _I32 = np.uint32, np.uint64, np.float32, np.int32
_LN_2 = math.log(2)
_TINY = _F32(2.0**-24)  # what u near 1 is rounded by: no sample is 0
_FASTMATH = {"contract", "reassoc", "nsz", "arcp"}
# ln(1 + t) / t³ - 1 / t² + 1 / 2t for t from sqrt(1/2) - 1 to sqrt(2) - 1; sin and cos up to π/4
# (Cephes' logf, sinf, cosf).
_LN = tuple(
    _F32(each)
    for each in (
        *(7.0376836292e-2, -1.1514610310e-1, 1.1676998740e-1, -1.2420140846e-1, 1.4249322787e-1),
        *(-1.6668057665e-1, 2.0000714765e-1, -2.4999993993e-1, 3.3333331174e-1),
    )
)
_SIN = tuple(_F32(each) for each in (-1.9515295891e-4, 8.3321608736e-3, -1.6666654611e-1))
_COS = tuple(_F32(each) for each in (2.4433157118e-5, -1.3887316255e-3, 4.1666645683e-2))


@njit(nogil=True, cache=True, error_model="numpy")
def add_noise(
    x: NDArray[np.float32],
    key: int,
    first: int,
    scale: float,
    bits: NDArray[np.uint32],
    radii: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Write x + noise of `scale` per part to `out`; both `[2n]`, real and imaginary parts in turn.

    `first` is the index of the first sample; `bits` and `radii` `[CHUNK]` are working memory.
    """
    n, done = x.size // 2, 0
    while done < n:
        chunk = (first + done) // CHUNK
        offset = first + done - chunk * CHUNK
        m = min(n - done, CHUNK - offset)
        keys = _split(_U64(key) + _U64(chunk) * _U64(0x9E3779B97F4A7C15))
        _hash(_U32(keys & _U64(0xFFFFFFFF)), offset, bits[:m])
        _make_radii(bits[:m], scale, radii[:m], radii[:m].view(_I32))
        _hash(_U32(keys >> _U64(32)), offset, bits[:m])
        _turn(bits[:m], radii[:m], x[2 * done :], out[2 * done :])
        done += m


@njit(nogil=True, cache=True, error_model="numpy")
def _split(z: np.uint64) -> np.uint64:
    """The hash of splitmix64, from 64 bits to 64."""
    z = (z ^ (z >> _U64(30))) * _U64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> _U64(27))) * _U64(0x94D049BB133111EB)
    return z ^ (z >> _U64(31))


@njit(nogil=True, cache=True, error_model="numpy")
def _hash(key: np.uint32, first: int, out: NDArray[np.uint32]) -> None:
    """Write 32 random bits for each counter from `first` on: Wellons' triple32 with a key."""
    for i in range(out.size):
        x = _U32(first + i) ^ key
        x = _U32(x ^ (x >> _U32(17)))
        x = _U32(x * _U32(0xED5AD4BB))
        x = _U32(x ^ (x >> _U32(11)))
        x = _U32(x * _U32(0xAC4C1B51))
        x = _U32(x ^ (x >> _U32(15)))
        x = _U32(x * _U32(0x31848BAB))
        out[i] = _U32(x ^ (x >> _U32(14)))


@njit(nogil=True, cache=True, error_model="numpy", fastmath=_FASTMATH)
def _make_radii(
    bits: NDArray[np.uint32],
    scale: float,
    radii: NDArray[np.float32],
    as_bits: NDArray[np.int32],
) -> None:
    """Write scale · sqrt(-2 ln u) with u = 2^-31 … 1 to `radii`; overwrites `bits`.

    `as_bits` is a view of `radii`.
    """
    for i in range(bits.size):
        radii[i] = _F32(_I32(bits[i] >> _U32(1))) + _F32(1)
    for i in range(bits.size):
        # u · 2^31 = mantissa · 2^exponent, mantissa from sqrt(1/2) to sqrt(2).
        exponent = _I32(_I32(as_bits[i] - _I32(0x3F3504F3)) >> _I32(23))
        as_bits[i] = _I32(as_bits[i] - _I32(exponent << _I32(23)))
        bits[i] = _U32(exponent)
    factor = _F32(scale)
    for i in range(bits.size):
        t = radii[i] - _F32(1)
        tail = _LN[0]
        for k in range(1, 9):
            tail = tail * t + _LN[k]
        ln = t + t * t * (tail * t - _F32(0.5))
        minus_ln_u = (_F32(31) - _F32(_I32(bits[i]))) * _F32(_LN_2) - ln
        radii[i] = factor * math.sqrt(_F32(2) * max(_TINY, minus_ln_u))


@njit(nogil=True, cache=True, error_model="numpy", fastmath=_FASTMATH)
def _turn(
    bits: NDArray[np.uint32],
    radii: NDArray[np.float32],
    x: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Add a point at each radius to `x`: 30 bits are an angle up to ±π/4, two are the quadrant."""
    for i in range(bits.size):
        y = _F32(_I32(bits[i]) >> _I32(2)) * _F32(2.0**-29 * math.pi / 4)
        yy = y * y
        sin = y + y * yy * ((_SIN[0] * yy + _SIN[1]) * yy + _SIN[2])
        cos = _F32(1) - yy * _F32(0.5) + yy * yy * ((_COS[0] * yy + _COS[1]) * yy + _COS[2])
        is_steep = (bits[i] & _U32(1)) != _U32(0)
        r = radii[i] if (bits[i] & _U32(2)) != _U32(0) else -radii[i]
        out[2 * i] = x[2 * i] + r * (sin if is_steep else cos)
        out[2 * i + 1] = x[2 * i + 1] + r * (cos if is_steep else sin)
