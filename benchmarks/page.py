"""Writes docs/benchmarks.md and draws its pictures from the kept results: `make figures`.

It measures nothing. `python -m benchmarks.NAME --keep` measures and keeps the rows.
"""

import sys
from collections.abc import Mapping
from typing import Any

from benchmarks import phy_curves
from benchmarks.kept import DOCS, kept
from benchmarks.latency import pictures as latency_pictures
from benchmarks.page_texts import TEXTS
from benchmarks.pound import pictures as pound_pictures
from benchmarks.report import SIGNS
from benchmarks.timesync import pictures as timesync_pictures
from sdrlinkd.cli.benchmarks import BENCHMARKS
from sdrlinkd.demo import PAPER_TABLE_6

PAGE = DOCS / "benchmarks.md"
DRAWN = {
    ("pound", "beside"): pound_pictures.draw,
    ("latency", "latency"): latency_pictures.draw,
    ("timesync", "filters"): timesync_pictures.draw,
    ("phy_curves", "curves"): phy_curves.draw,
}
"""The function that draws each kept drawing, by benchmark and name of the drawing."""

PICTURES = {
    "phy_per": ["per_curves.png"],
    "pound": ["pound_delays.png", "pound_bandwidth_and_loop.png"],
    "timesync": ["timesync_errors.png", "timesync_rms.png"],
    "latency": ["latency_fwd.png", "latency_bwd.png", "latency_load.png"],
}
ALTERNATIVES = {
    "per_curves.png": "Share of PDUs lost over SNR, for every MCS",
    "pound_delays.png": "Delay and jitter of laser and image, beside others",
    "pound_bandwidth_and_loop.png": "Bandwidth by message size, and the control loop",
    "timesync_errors.png": "Errors of clock filters over time",
    "timesync_rms.png": "Errors of clock filters at the end",
    "latency_fwd.png": "Latency, companion computer to flight controller",
    "latency_bwd.png": "Latency, flight controller to companion computer",
    "latency_load.png": "Processor and memory of each system",
}

DEMO = (
    "The experiment of *Bridging ROS 2 and GNU Radio*, in real time: a built-in robot's topics, "
    "PDUs of 64 B, QPSK 1/2 at 5 Msps, 15 dB. *ofdm* goes through the modem and a simulated radio, "
    "*iqfile* through a recording of samples, *direct* without a radio. The pictures are the "
    "paper's Figures 6 and 7."
)

INTRODUCTION = """\
# Benchmarks

The command above each table prints its figures, beside peers in the same run. `make bench` runs
all of them; `--keep` keeps the results, and `make figures` writes this page.

- *ok* judges the value as it is printed: **missed** is a miss, and the exit code is then 1. A row
  without a target is only reported.
- Rows in lock-step and rows of counted trials are exact: the same seed gives the same figures on
  any machine. Rows of real time and of speed depend on the machine, and on how much of it a
  hypervisor gave to others (*stolen*).
"""


def page() -> str:
    """The page in Markdown, from the kept results."""
    reports = {name: report for name in BENCHMARKS if (report := kept(name)) and "rows" in report}
    judged = [row for report in reports.values() for row in report["rows"]
              if row["target"] is not None]  # fmt: skip
    met = sum(row["ok"] for row in judged)
    missed = [
        f"`{row['name']}` ({name})"
        for name, report in reports.items()
        for row in report["rows"]
        if not row["ok"]
    ]
    summary = f"**{met} of {len(judged)} targets are met.**"
    if missed:
        summary += f" Missed: {', '.join(missed)}."
    parts = [INTRODUCTION, summary, ""]
    if demo := kept("demo"):
        parts += [_demo(demo), ""]
    for name, report in reports.items():
        parts += [_section(name, report), ""]
    return "\n".join(parts).rstrip() + "\n"


def draw() -> list[str]:
    """Draw all kept drawings; returns the names of their benchmarks."""
    drawn = []
    for (name, drawing), make in DRAWN.items():
        report = kept(name) or {}
        if drawing in report.get("drawings", {}):
            make(report["drawings"][drawing])
            drawn.append(name)
    return drawn


def _demo(report: Mapping[str, Any]) -> str:
    """The section of the demo: the paper's Table 6 with our runs."""
    rows = [
        f"| {run['name']} | {run['duration_s']:.1f} | {run['sent']} | {run['received']} "
        f"| {run['pdr']:.3f} | {run['goodput_bytes_per_s']:,.0f} | {run['latency_ms']['p50']:.2f} "
        f"| {run['latency_ms']['p99']:.2f} | {run['path_error_m']:.4f} |"
        for run in report["runs"]
    ]
    return "\n".join([
        "## demo", "", DEMO, "", "```sh\nsdrlinkctl demo\n```", "",
        f"*{_where(report)}*", "",
        "| configuration | s | sent | received | PDR | B/s | p50 ms | p99 ms | path error m |",
        "|---|---|---|---|---|---|---|---|---|",
        *rows,
        *(f"| paper, {name}, /odom | {' | '.join(cells)} | | | |"
          for name, cells in PAPER_TABLE_6.items()), "",
        "![Distribution of the latency](figures/latency_cdf.png)", "",
        "![Paths sent and received](figures/path.png)",
    ])  # fmt: skip


def _where(report: Mapping[str, Any]) -> str:
    return f"{report['machine']}; {report['stolen_pct']:g} % stolen; {report['date']}"


def _section(name: str, report: Mapping[str, Any]) -> str:
    lines = [
        f"## {name}", "", BENCHMARKS[name].sentence + " " + TEXTS.get(name, ""), "",
        f"```sh\n{report['command']}\n```", "", f"*{_where(report)}; seed {report['seed']}*", "",
        "| row | value | target | ok | peers in the same run | paper | trials |",
        "|---|---|---|---|---|---|---|",
        *(_row(row) for row in report["rows"]),
    ]  # fmt: skip
    if report["not_measured"]:
        lines += ["", "Not measured in this run: " + "; ".join(
            f"{what} ({why})" for what, why in report["not_measured"].items()
        ) + "."]  # fmt: skip
    for picture in PICTURES.get(name, ()):
        lines += ["", f"![{ALTERNATIVES[picture]}](figures/{picture})"]
    return "\n".join(lines)


def _row(row: Mapping[str, Any]) -> str:
    value = f"{_number(row['value'])} {row['unit']}".strip()
    if row["like_for_like"] is not None:
        value += f" ({_number(row['like_for_like'])})"
    target, ok = "", ""
    if row["target"] is not None:
        target = f"{SIGNS[row['better']]} {_number(row['target'])}"
        ok = "ok" if row["ok"] else "**missed**"
    peers = ", ".join(f"{name} {_number(each)}" for name, each in row["peers"].items())
    paper = "" if row["paper"] is None else _number(row["paper"])
    name = f"`{row['name']}`"
    if includes := row.get("includes"):
        name += f": {includes}"
    cells = (name, value, target, ok, peers, paper, f"{row['trials']:,}")
    return "| " + " | ".join(each.replace("|", "\\|") for each in cells) + " |"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:,.4g}"


def main() -> int:
    """Write the page, draw the pictures."""
    drawn = draw()
    PAGE.write_text(page())
    sys.stdout.write(f"wrote {PAGE.name}; drew {', '.join(drawn) or 'nothing'}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
