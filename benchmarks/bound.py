"""The least error rate that any code can have: the normal approximation at a finite length.

Polyanskiy, Poor and Verdú, "Channel Coding Rate in the Finite Blocklength Regime", IEEE Trans. Inf.
Theory 56 (2010), equation 296, with the mutual information and the dispersion of the constellation.
"""

import math

import numpy as np
from scipy.optimize import brentq
from scipy.special import roots_hermite
from scipy.stats import norm

from phy import Mcs, points

N_NODES = 24


def needed_es_n0_db(mcs: Mcs, n_bits: int, n_subcarriers: float, error_rate: float) -> float:
    """Es/N0 in dB for `n_bits` in `n_subcarriers` uses to fail with probability `error_rate`."""
    distance = norm.isf(error_rate)

    def surplus(es_n0_db: float) -> float:
        information, dispersion = _moments(mcs, es_n0_db)
        reach = n_subcarriers * information - math.sqrt(n_subcarriers * dispersion) * distance
        return float(reach + 0.5 * math.log2(n_subcarriers) - n_bits)

    return float(brentq(surplus, -10.0, 45.0, xtol=1e-3))


def _moments(mcs: Mcs, es_n0_db: float) -> tuple[float, float]:
    """Mean and variance of the information density in bits per use, with equally likely points."""
    constellation = points(mcs.modulation).astype(np.complex128)
    nodes, weights = roots_hermite(N_NODES)
    noise = (nodes[:, None] + 1j * nodes[None, :]).reshape(-1)
    weight = (weights[:, None] * weights[None, :]).reshape(-1) / math.pi
    scale = math.sqrt(10 ** (es_n0_db / 10))
    sent = scale * constellation
    mean, square = 0.0, 0.0
    for point in sent:
        distance = np.abs(point + noise[:, None] - sent[None, :]) ** 2 - np.abs(noise[:, None]) ** 2
        density = math.log2(len(sent)) - np.log2(np.exp(-distance).sum(axis=1))
        mean += float(weight @ density) / len(sent)
        square += float(weight @ density**2) / len(sent)
    return mean, max(0.0, square - mean * mean)
