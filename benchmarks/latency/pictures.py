"""Figures 6, 7, 9 and 10 of the Sensors 2023 paper, as an emulation; 11 as bars."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import gaussian_kde

from benchmarks.latency.rows import ways
from benchmarks.latency.session import Session

FOLDER = Path(__file__).parents[2] / "docs" / "figures"
COMMAND = "python -m benchmarks.latency"
SHOWN = 400
"""Number of messages in a row that are shown."""
LONGEST_MS = 8.0


def draw(found: dict[str, list[Session]]) -> None:
    """Draw all figures of this benchmark."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for way, title in (("fwd", "odometry, companion to FCU"), ("bwd", "IMU, FCU to companion")):
        figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6))
        for name, passes in found.items():
            latencies_ms = 1e3 * ways(passes[0])[way].true_s
            if len(latencies_ms) < 2:
                continue
            left.plot(latencies_ms[:SHOWN], lw=0.8, label=name)
            shown = latencies_ms[latencies_ms < LONGEST_MS]
            if len(shown) > 2 and np.std(shown) > 0:
                x = np.linspace(0, LONGEST_MS, 400)
                right.plot(x, gaussian_kde(shown)(x), label=name)
        left.set(xlabel="message", ylabel="latency, ms", ylim=(0, LONGEST_MS))
        right.set(xlabel="latency, ms", ylabel="density per ms")
        left.legend(fontsize=7)
        for axis in (left, right):
            axis.grid(alpha=0.3)
        figure.suptitle(f"{title}: 115 bytes at 200 Hz", fontsize=10)
        figure.text(0.99, 0.005, COMMAND, ha="right", fontsize=6, color="grey")
        figure.tight_layout()
        figure.savefig(FOLDER / f"latency_{way}.png", dpi=120)
        plt.close(figure)
    _load(found)


def _load(found: dict[str, list[Session]]) -> None:
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.4))
    for axis, what, unit in ((axes[0], "cpu_share", "cores"), (axes[1], "rss_mib", "MiB")):
        base = np.zeros(len(found))
        names = sorted({each for passes in found.values() for each in getattr(passes[0], what)})
        for process in names:
            values = np.array([getattr(p[0], what).get(process, 0.0) for p in found.values()])
            axis.bar(list(found), values, bottom=base, label=process)
            base += values
        axis.set_ylabel(unit)
        axis.grid(axis="y", alpha=0.3)
    axes[0].legend(fontsize=7)
    figure.text(0.99, 0.005, COMMAND, ha="right", fontsize=6, color="grey")
    figure.tight_layout()
    figure.savefig(FOLDER / "latency_load.png", dpi=120)
    plt.close(figure)
