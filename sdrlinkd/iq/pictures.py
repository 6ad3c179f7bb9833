"""Pictures of a recording: its spectrum and its constellation."""

from pathlib import Path

import numpy as np

import phy
from sdrlinkd.colors import COLORS
from sdrlinkd.iq.recording import Points
from sdrlinkd.iq.spectrum import Spectrum
from sdrlinkd.pictures import OURS, make_figure, save

# Dynamic range of the color scale, in dB below the strongest value.
RANGE_DB = 70


def draw_spectrum(spectrum: Spectrum, rate_hz: float | None, title: str, path: Path) -> None:
    """Draw power over frequency, and below it a waterfall of power over frequency and time."""
    unit, scale = ("MHz", rate_hz / 1e6) if rate_hz else ("cycles a sample", 1.0)
    time_unit, time_scale = ("s", 1 / rate_hz) if rate_hz else ("samples", 1.0)
    figure, panels = make_figure(2, 1, (8.0, 7.5), sharex=True, height_ratios=(2, 3))
    power, waterfall = panels[:, 0]
    frequency = spectrum.frequency * scale
    power.plot(frequency, spectrum.peak, color="0.7", linewidth=0.8, label="peak")
    power.plot(frequency, spectrum.mean, color=OURS, linewidth=1.0, label="mean")
    edge = (phy.OFDM_64_16.edge + 0.5) / phy.OFDM_64_16.n_fft * scale
    for at in (-edge, edge):
        power.axvline(at, color=COLORS[4], linewidth=0.8, linestyle=":")
    top = float(spectrum.peak.max())
    power.set(ylabel="dBFS a bin", title=title, ylim=(top - RANGE_DB, top + 5))
    power.legend(loc="upper right", frameon=False, ncols=2)
    last = spectrum.time[-1] + (spectrum.time[1] if len(spectrum.time) > 1 else 1)
    image = waterfall.imshow(
        spectrum.waterfall,
        aspect="auto",
        origin="upper",
        extent=(-0.5 * scale, 0.5 * scale, last * time_scale, 0.0),
        vmin=max(top - RANGE_DB, float(np.median(spectrum.waterfall)) - 5),
        vmax=top,
        cmap="viridis",
        interpolation="nearest",
    )
    waterfall.set(xlabel=f"frequency in {unit}", ylabel=f"time in {time_unit}")
    waterfall.grid(visible=False)
    figure.colorbar(image, ax=waterfall, label="dBFS a bin")
    save(figure, path, "dotted: edges of the OFDM signal")


def draw_constellation(points: Points, title: str, path: Path) -> None:
    """Draw the equalised points and the ideal ones, one panel per modulation."""
    found = sorted(points.by_modulation, key=lambda each: each.bits)
    figure, panels = make_figure(1, len(found), (5.0 * len(found), 5.4))
    figure.suptitle(title)
    for axes, modulation in zip(panels[0], found, strict=True):
        got = points.by_modulation[modulation]
        meant = phy.points(modulation)
        axes.plot(got.real, got.imag, ".", markersize=1.5, alpha=0.4, color=COLORS[2])
        axes.plot(meant.real, meant.imag, "+", markersize=9, color=OURS)
        nearest = meant[np.abs(got[:, None] - meant[None, :]).argmin(axis=1)]
        error = np.mean(np.abs(got - nearest) ** 2)
        axes.set_title(
            f"{modulation.label}, {len(got)} points, EVM {10 * np.log10(error + 1e-20):.1f} dB"
        )
        axes.set(xlim=(-1.8, 1.8), ylim=(-1.8, 1.8), aspect="equal", xlabel="I", ylabel="Q")
    save(figure, path, "dots: received; crosses: meant")
