"""The benchmarks run, print their rows, and meet exact targets; speeds are not tested."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.phy_per import false_pdus_in
from phy import Transmitter
from sdrlinkd.cli.benchmarks import BENCHMARKS
from tests.benchmark_rows import ROWS
from tests.pdulink.gnu_radio import no_gnu_radio
from tests.ros.wheels import lacking as no_rclpy
from tests.soapy_loopback import missing as no_test_radio

ROOT = Path(__file__).parents[1]


# Benchmarks whose rows are all exact, and those that have others as well.
ALL_EXACT = {"access", "phy_per", "repeats", "rough", "team", "timesync"}
SOME_EXACT = {"defaults", "latency", "pound", "sealing"}
# Exact rows that miss their targets, and are shown so: see tests/benchmarks_pound/test_lockstep.py.
MISSED = {
    # A robot that is alone in the air uses little more than its own slots.
    "defaults": {
        *(f"big_{size}_of_the_rest_pct" for size in ("200kB", "1MB", "3MB")),
        *(f"alone_{size}_pct" for size in ("50kB", "400kB", "800kB", "1500kB")),
        # An image of 14 PDUs, which gets what its robot's slots leave.
        "nav2_p99_ms",
    },
    "pound": {
        "image_1ch_stdD_ms", "rlc_rms_vs_local_mV", "laser_1ch_defaults_D_ms",
        *(f"image_1ch_defaults_{each}" for each in ("D_ms", "stdD_ms", "mdr_pct")),
    },
}  # fmt: skip
# Rows of recordings that are not available everywhere.
OPTIONAL = {"ptp_over_wifi_strays_ms"}
# Rows of a rate at which a slow machine's daemon has no time left to answer: the benchmark says so.
FAST = {row for row in ROWS["radio"] if "_10msps_" in row}
# It takes a few seconds; the others are for the long tier.
SMALL = {"sealing"}
# Why a benchmark cannot run here, if so.
LACKING = {"radio": no_test_radio, "flowgraphs": no_gnu_radio, "adapters": no_rclpy}
# Peers take long, and need the machine to themselves.
MORE = {"pound": ("--no-peers",), "latency": ("--no-peers",)}


def modules_that_run():
    """All modules below `benchmarks` that are called by name, except the ends of peers."""
    for path in sorted((ROOT / "benchmarks").rglob("*.py")):
        name = path.relative_to(ROOT / "benchmarks").with_suffix("").as_posix().replace("/", ".")
        if name.endswith("__main__"):
            yield name.removesuffix("__main__").removesuffix(".")
        elif '__name__ == "__main__"' in path.read_text() and not name.startswith("peers."):
            yield name


def test_every_benchmark_is_in_the_list():
    """The list that `make bench` and `sdrlinkctl bench` use; "" runs all, `page` writes them up."""
    assert {*modules_that_run()} - {"", "page"} == set(BENCHMARKS)
    assert set(ROWS) == {name for name, each in BENCHMARKS.items() if each.has_rows}
    texts = [path.read_text() for path in (ROOT / "benchmarks").rglob("*.py")]
    printing = [name for text in texts for name in re.findall(r'main\("(\w+)", measure', text)]
    assert sorted(ROWS) == sorted(printing)
    needy = {name for name in ROWS if BENCHMARKS[name].needs}
    assert set(LACKING) == needy | {"adapters"}, "wheels, which are no Debian packages"


def test_what_is_kept_has_the_rows_that_are_printed():
    for name, rows in ROWS.items():
        kept = ROOT / "docs/measured" / f"{name}.json"
        if kept.exists():
            told = {row["name"] for row in json.loads(kept.read_text())["rows"]}
            assert told - OPTIONAL == rows, name


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [n if n in SMALL else pytest.param(n, marks=pytest.mark.long) for n in ROWS]
)
def test_a_benchmark_prints_its_rows(name):
    if reason := LACKING.get(name, str)():
        pytest.skip(reason)
    done = subprocess.run(
        [sys.executable, "-m", f"benchmarks.{name}", "--quick", "--json", *MORE.get(name, ())],
        cwd=ROOT, capture_output=True, text=True, timeout=900,
    )  # fmt: skip
    report = json.loads(done.stdout)
    assert report["benchmark"] == name
    rows = {row["name"]: row for row in report["rows"]}
    too_fast = FAST if "not measured: radios like a USRP" in done.stderr else set()
    assert set(rows) - OPTIONAL | too_fast == ROWS[name] | too_fast
    for row in rows.values():
        assert {"value", "unit", "target", "ok", "peers", "paper", "trials", "exact"} <= row.keys()
        # A value that should be small may be zero.
        assert row["value"] > 0 or row["better"] == "less" or row["unit"] == "dB"
    exact = [row["exact"] for row in rows.values()]
    assert (all(exact), any(exact)) == (name in ALL_EXACT, name in ALL_EXACT | SOME_EXACT)
    missed = {row["name"]: (row["value"], row["target"])
              for row in rows.values() if row["exact"] and not row["ok"]}  # fmt: skip
    assert missed.keys() <= MISSED.get(name, set()), (
        "exact rows are the same on every machine, so a miss is ours"
    )
    assert done.returncode == (0 if all(row["ok"] for row in rows.values()) else 1)


def test_pdus_in_recordings_of_others_are_counted(tmp_path):
    rng = np.random.default_rng(3)
    noise = 0.01 * (rng.standard_normal((200_000, 2)) @ [1, 1j])
    noise.astype(np.complex64).tofile(tmp_path / "noise.cf32")
    (tmp_path / "notes.txt").write_text("no samples\n")
    row = false_pdus_in(tmp_path)
    assert (row.value, row.trials, row.note, row.ok) == (0, 200_000, "noise.cf32", True)
    # The control: one of our own modules would be reported.
    burst = Transmitter().modulate([bytes(64)], 1)
    noise[50_000 : 50_000 + len(burst)] += 0.3 * burst
    noise.astype(np.complex64).tofile(tmp_path / "ours.cf32")
    row = false_pdus_in(tmp_path)
    assert (row.value, row.ok) == (1, False)
