"""Error rate over SNR for every MCS, and how little any code of that length could do with.

python -m benchmarks.phy_curves    keeps the curves in docs/measured; `make figures` draws them.
"""

import sys
from collections.abc import Mapping
from typing import Any

import numpy as np

from benchmarks.bound import needed_es_n0_db
from benchmarks.kept import FIGURES, keep
from benchmarks.phy_per import PER_SUBCARRIER_DB
from benchmarks.trials import Air, error_rate
from phy import MCS_TABLE, OFDM_64_16, layout, needed_snr_db
from sdrlinkd.pictures import QUIET, legend_beside, looks, make_figure, save

N_BYTES, N_BURSTS, STEP_DB = 220, 800, 0.4
MOST_POINTS = 14
COMMAND = "python -m benchmarks.phy_curves"
BOUNDS = (0.5, 0.1, 0.01, 0.001)


def main() -> int:
    """Measure all curves, and keep them."""
    curves = {}
    for mcs in MCS_TABLE:
        snr_db = needed_snr_db(mcs.index, N_BYTES) - 1.6
        seen: list[tuple[float, float]] = []
        while not seen or (seen[-1][1] > 2 / N_BURSTS and len(seen) < MOST_POINTS):
            rate = error_rate(Air(), mcs.index, N_BYTES, snr_db, 1, N_BURSTS, 200)
            seen.append((snr_db, rate.share))
            snr_db += STEP_DB
        uses = layout(OFDM_64_16, mcs.index, 1, N_BYTES).n_symbols * OFDM_64_16.n_data
        bound = [
            needed_es_n0_db(mcs, 8 * N_BYTES, uses, each) - PER_SUBCARRIER_DB for each in BOUNDS
        ]
        curves[mcs.name] = {"measured": seen, "bound": list(zip(bound, BOUNDS, strict=True))}
        sys.stderr.write(f"{mcs.name}: {len(seen)} points\n")
    path = keep("phy_curves", {"command": COMMAND, "drawings": {"curves": curves}})
    sys.stdout.write(f"kept in {path}; `make figures` draws it\n")
    return 0


def draw(curves: Mapping[str, Any]) -> None:
    """Draw docs/figures/per_curves.png."""
    figure, panels = make_figure(size=(10.0, 5.0))
    axes = panels[0, 0]
    for (name, curve), look in zip(curves.items(), looks(curves).values(), strict=True):
        at, rates = np.array(curve["measured"]).T
        axes.semilogy(at, np.maximum(rates, 1e-4), color=look.color, linestyle=look.line,
                      marker=look.marker, ms=4, label=name)  # fmt: skip
        axes.semilogy(*np.array(curve["bound"]).T, ":", color=QUIET, lw=1.0)
    axes.set(
        xlabel="SNR in the sample band in dB", ylabel="share of PDUs lost", ylim=(8e-4, 1.1)
    )  # fmt: skip
    legend_beside(axes)
    save(figure, FIGURES / "per_curves.png",
         f"{COMMAND}; {N_BYTES} B, all impairments; dotted: what any code of that length could do, "
         "channel known (normal approximation)")  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
