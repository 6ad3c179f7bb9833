"""Draws the error rate over SNR for every MCS, with the bound for any code of that length.

python -m benchmarks.phy_curves    writes docs/figures/per_curves.png
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from benchmarks.bound import needed_es_n0_db
from benchmarks.phy_per import PER_SUBCARRIER_DB
from benchmarks.trials import Air, error_rate
from phy import MCS_TABLE, OFDM_64_16, layout, needed_snr_db

N_BYTES, N_BURSTS, STEP_DB = 220, 800, 0.4
MOST_POINTS = 14
FIGURE = Path(__file__).parents[1] / "docs/figures/per_curves.png"
BOUNDS = (0.5, 0.1, 0.01, 0.001)


def main() -> int:
    """Measure all curves, and draw them."""
    figure, axes = plt.subplots(figsize=(10, 5))
    for mcs in MCS_TABLE:
        colour = f"C{mcs.index}"
        snr_db = needed_snr_db(mcs.index, N_BYTES) - 1.6
        seen: list[tuple[float, float]] = []
        while not seen or (seen[-1][1] > 2 / N_BURSTS and len(seen) < MOST_POINTS):
            rate = error_rate(Air(), mcs.index, N_BYTES, snr_db, 1, N_BURSTS, 200)
            seen.append((snr_db, rate.share))
            snr_db += STEP_DB
        at, rates = np.array(seen).T
        axes.semilogy(at, np.maximum(rates, 1e-4), "o-", color=colour, ms=3, label=mcs.name)
        plan = layout(OFDM_64_16, mcs.index, 1, N_BYTES)
        uses = plan.n_symbols * OFDM_64_16.n_data
        bound = [
            needed_es_n0_db(mcs, 8 * N_BYTES, uses, each) - PER_SUBCARRIER_DB for each in BOUNDS
        ]
        axes.semilogy(bound, BOUNDS, ":", color=colour)
    axes.set(
        xlabel="SNR in the sample band, dB", ylabel="share of PDUs lost", ylim=(8e-4, 1.1),
        title=f"{N_BYTES} B, all impairments; dotted: normal approximation, known channel",
    )  # fmt: skip
    axes.grid(which="both", alpha=0.25)
    axes.legend(ncols=2, fontsize=8)
    FIGURE.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(FIGURE, dpi=110, bbox_inches="tight")
    sys.stdout.write(f"wrote {FIGURE}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
