"""Rows of RT-WMP: beside the Pound paper's figures of it, and in a team on our air."""

from collections.abc import Iterator
from functools import partial
from statistics import mean

import numpy as np

from benchmarks.flows import Figures, Trace, figures
from benchmarks.peers.pound.rtwmp import PAPER
from benchmarks.report import Row
from benchmarks.team.rtwmp import (
    AS_PROGRAMMED,
    FITTED,
    LINKS,
    PATIENT,
    Shared,
    reconnection_s,
    share,
    tables,
)
from benchmarks.team.runs import Runs, all_of

PAPERS = {
    2: (Figures(20.1, 2.8, 4.7, 5.0, 99.6, 0.399),
        Figures(233.6, 141.3, 4635.9, 2738.1, 64.2, 2.196)),
    3: (Figures(20.3, 4.2, 8.1, 4.5, 98.3, 0.394),
        Figures(1108.2, 1153.9, 14479.1, 4484.5, 27.1, 0.463)),
}  # fmt: skip
"""RT-WMP's own rows in Tables I to IV: laser and image, by number of nodes."""
PAPERS_V_S = {2: mean((0.42, 0.54)), 3: mean((0.50, 0.49))}
"""Table V: the mean of both flows."""
LOSS, RARE_LOSS = 0.01, 3e-4
COLUMNS = {
    "laser": {"ms": "d_ms", "std_ms": "std_d_ms", "mdr_pct": "mdr_pct"},
    "image": {"ms": "d_ms", "period_ms": "jd_ms", "mdr_pct": "mdr_pct", "mbps": "mbps"},
}
UNITS = {"ms": "ms", "pct": "%", "mbps": "Mbit/s"}


PARAMS = (FITTED, AS_PROGRAMMED, PATIENT)


def rows(runs: Runs, seed: int, quick: bool) -> Iterator[Row]:
    """All rows; none has a target, since nothing of ours is measured."""
    traces = {
        n: [
            runs.add(
                f"RT-WMP's tables, {n} nodes", 20.0,
                partial(tables, n, seed, quick, params, loss),
            )
            for params, loss in (
                (FITTED, 0), (PAPER, 0), (AS_PROGRAMMED, 0), (PATIENT, RARE_LOSS), (FITTED, LOSS),
            )
        ]
        for n in LINKS
    }  # fmt: skip
    trials = 2 if quick else 20
    outages = {
        n: [
            runs.add(
                f"RT-WMP's outages, {n} nodes", 10.0,
                partial(reconnection_s, n, seed, trials, params),
            )
            for params in PARAMS
        ]
        for n in LINKS
    }  # fmt: skip
    duration_s = 4.0 if quick else 120.0
    shared = {
        n: runs.add(f"RT-WMP, {n} robots", n * duration_s, partial(share, n, seed, duration_s))
        for n in (8, 24)
    }

    def found() -> Iterator[Row]:
        for n, of in traces.items():
            yield from _tables(n, all_of(of))
        for n, each in outages.items():
            yield _outages(n, all_of(each))
        for n, run in shared.items():
            yield from _shared(n, run.result())

    return found()


def _outages(n_nodes: int, all_back_s: list[list[float]]) -> Row:
    found, programmed, patient = all_back_s
    value, paper = mean(found), PAPERS_V_S[n_nodes]
    return Row(
        f"rtwmp_table5_{n_nodes}n_s", value, "s", None, "less", len(found),
        {
            "over_paper": value / paper,
            "as_programmed": mean(programmed),
            "wait_100ms": mean(patient),
        },
        paper,
        f"from the return of the radio until each flow comes; at worst {max(found):.3f} s; "
        "the paper's cards rejoin their network in this time",
    )  # fmt: skip


def _tables(n_nodes: int, runs: list[list[Trace]]) -> Iterator[Row]:
    fitted, bare, programmed, patient, lossy = ([figures(trace) for trace in run] for run in runs)
    for i, (flow, columns) in enumerate(COLUMNS.items()):
        table = 2 * n_nodes - 3 + i
        note = (
            f"{n_nodes} nodes; {_told(fitted[i])}; with {100 * LOSS:g} % of frames lost: "
            f"{_told(lossy[i])}"
        )
        for name, column in columns.items():
            value, paper = getattr(fitted[i], column), getattr(PAPERS[n_nodes][i], column)
            unit = UNITS[name.rsplit("_", maxsplit=1)[-1]]
            yield Row(
                f"rtwmp_table{table}_{flow}_{name}", value, unit, None,
                "less" if unit == "ms" else "more", runs[0][i].flow.count,
                {
                    "over_paper": value / paper,
                    "no_host_time": getattr(bare[i], column),
                    "as_programmed": getattr(programmed[i], column),
                    "wait_100ms": getattr(patient[i], column),
                },
                paper, note,
            )  # fmt: skip


def _shared(n_nodes: int, found: Shared) -> Iterator[Row]:
    delays_ms = 1e3 * np.array(found.delays_s)
    loops = found.frames["message"]
    note = (
        f"{n_nodes} robots that all hear each other, 6 Mbit/s, turnaround 0.1 ms; one sends 64 B "
        "at random, the others have bulk, or anything else of lower priority; "
        f"{found.frames['token'] / loops:.1f} tokens for each part of a message"
    )
    yield Row(
        f"rtwmp_urgent_p99_ms_{n_nodes}", float(np.quantile(delays_ms, 0.99)), "ms", None, "less",
        len(delays_ms),
        {
            "p50_ms": float(np.median(delays_ms)),
            "max_ms": float(delays_ms.max()),
            "worst_case_ms": 1e3 * found.worst_s,
        },
        note=note,
    )  # fmt: skip
    yield Row(
        f"rtwmp_carried_mbps_{n_nodes}", found.carried_mbps, "Mbit/s", None, "more", loops,
        note=note,
    )  # fmt: skip


def _told(of: Figures) -> str:
    """All columns of the paper's table."""
    return (
        f"Jd {of.jd_ms:.1f} ms, std {of.std_jd_ms:.1f}, D {of.d_ms:.2f}, std {of.std_d_ms:.2f}, "
        f"MDR {of.mdr_pct:.1f} %, {of.mbps:.3f} Mbit/s"
    )
