"""Known symbols against received ones: correlation, least squares, frequency."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(nogil=True, cache=True)
def correlate(
    x: NDArray[np.complex64],
    frequency: float,
    templates: NDArray[np.complex64],
    out: NDArray[np.float32],
) -> None:
    """Strength of two templates in a row at each offset of `x` turned back by `frequency`.

    out[a, o] = |Σ_m z[o + m] t*[a, m] + Σ_m z[o + n + m] t*[a, m]|², `templates` `[aliases, n]`.
    """
    n_template = templates.shape[1]
    n_out = out.shape[1]
    n = n_out + n_template
    re, im = np.empty(x.size, np.float32), np.empty(x.size, np.float32)
    step = -2 * math.pi * frequency
    for i in range(x.size):
        turned = complex(x[i]) * complex(math.cos(step * i), math.sin(step * i))
        re[i] = np.float32(turned.real)
        im[i] = np.float32(turned.imag)
    for a in range(templates.shape[0]):
        c_re, c_im = np.zeros(n, np.float32), np.zeros(n, np.float32)
        for m in range(n_template):
            t_re, t_im = templates[a, m].real, templates[a, m].imag
            x_re, x_im = re[m : m + n], im[m : m + n]
            for o in range(n):
                c_re[o] += x_re[o] * t_re + x_im[o] * t_im
                c_im[o] += x_im[o] * t_re - x_re[o] * t_im
        second_re, second_im = c_re[n_template:], c_im[n_template:]
        for o in range(n_out):
            both_re = c_re[o] + second_re[o]
            both_im = c_im[o] + second_im[o]
            out[a, o] = both_re * both_re + both_im * both_im


@njit(nogil=True, cache=True)
def energy(x: NDArray[np.complex64]) -> float:
    """Σ |x|²."""
    total = 0.0
    for i in range(x.size):
        total += float(x[i].real) * x[i].real + float(x[i].imag) * x[i].imag
    return total


@njit(nogil=True, cache=True)
def lag_product(x: NDArray[np.complex64], lag: int) -> complex:
    """Σ x[i + lag] x*[i] over the first `lag` samples."""
    total = 0j
    for i in range(lag):
        total += complex(x[i + lag]) * complex(x[i]).conjugate()
    return total


@njit(nogil=True, cache=True)
def least_squares(
    bins: NDArray[np.complex64],
    used: NDArray[np.int64],
    sent: NDArray[np.complex64],
    out: NDArray[np.complex64],
) -> tuple[float, float]:
    """Mean gain of each carrier in use over `n` symbols; (noise power on a carrier, mean |h|²).

    `bins` `[n, n_fft]`, `sent` `[n, n_used]` of magnitude 1.
    """
    n = bins.shape[0]
    noise, power = 0.0, 0.0
    for c in range(used.size):
        mean, square = 0j, 0.0
        for s in range(n):
            gain = complex(bins[s, used[c]]) * complex(sent[s, c]).conjugate()
            mean += gain
            square += gain.real * gain.real + gain.imag * gain.imag
        mean /= n
        size = mean.real * mean.real + mean.imag * mean.imag
        noise += square - n * size
        power += size
        out[c] = np.complex64(mean)
    return noise / ((n - 1) * used.size), power / used.size


@njit(nogil=True, cache=True)
def match_blocks(
    x: NDArray[np.complex64],
    frequency: float,
    short_template: NDArray[np.complex64],
    cover: NDArray[np.float32],
    first_clean: int,
    n_clean: int,
    long_template: NDArray[np.complex64],
    long_start: int,
    block: int,
    out: NDArray[np.complex128],
) -> None:
    """How each part of the preamble matches its template, turned back by `frequency`.

    `x` begins with the short training. One sum for each short segment's clean samples, then one for
    each `block` samples of the long training at `long_start`. Phase 0 at `x[0]`.
    """
    step = -2 * math.pi * frequency
    segment = short_template.size
    for s in range(cover.size):
        total = 0j
        for m in range(first_clean, first_clean + n_clean):
            at = segment * s + m
            turn = complex(math.cos(step * at), math.sin(step * at))
            total += complex(x[at]) * complex(short_template[m % segment]).conjugate() * turn
        out[s] = total * cover[s]
    n_long = out.size - cover.size
    for b in range(n_long):
        total = 0j
        for m in range(block):
            at = long_start + block * b + m
            turn = complex(math.cos(step * at), math.sin(step * at))
            known = complex(long_template[(block * b + m) % long_template.size])
            total += complex(x[at]) * known.conjugate() * turn
        out[cover.size + b] = total


# Sums in any order, so that they are vectorised; the order is the same at every call.
@njit(nogil=True, cache=True, fastmath={"reassoc", "contract"})
def transform(matrix: NDArray[np.complex64], x: NDArray[np.complex64]) -> NDArray[np.complex64]:
    """matrix · x, without BLAS: its threads cost more than so small a product."""
    out = np.empty(matrix.shape[0], np.complex64)
    for i in range(matrix.shape[0]):
        re, im = np.float32(0), np.float32(0)
        for j in range(matrix.shape[1]):
            a, b = matrix[i, j], x[j]
            re += a.real * b.real - a.imag * b.imag
            im += a.real * b.imag + a.imag * b.real
        out[i] = complex(re, im)
    return out


@njit(nogil=True, cache=True)
def likelihood(
    turns: NDArray[np.complex128], blocks: NDArray[np.complex128], out: NDArray[np.float64]
) -> None:
    """|turns · blocks|² for each row."""
    for i in range(turns.shape[0]):
        total = 0j
        for j in range(blocks.size):
            total += turns[i, j] * blocks[j]
        out[i] = total.real * total.real + total.imag * total.imag
