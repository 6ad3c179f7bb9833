"""What a benchmark prints: misses as misses, and everything that could be measured."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks import absent, phy_speed, report
from benchmarks.absent import PeerError, attempt
from benchmarks.latency import rows
from benchmarks.peers.modems import gnu_radio
from benchmarks.pound import beside
from benchmarks.report import Drawing, Row, exactly, table_of
from sdrlinkd.process import ProcessError
from sdrlinkd.tables import screen_console

ROOT = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def nothing_told():
    absent.forget()


@pytest.mark.parametrize(("value", "target", "better", "ok"), [
    (3.0, 3.0, "less", True), (3.1, 3.0, "less", False),
    (3.0, 3.0, "more", True), (2.9, 3.0, "more", False), (1e9, None, "less", True),
    (float("nan"), 3.0, "less", False),
])  # fmt: skip
def test_the_value_that_is_printed_is_judged(value, target, better, ok):
    for scaled in (None, 0.0, 1e9):
        assert Row("x", value, "s", target, better, 1, like_for_like=scaled).ok == ok


def test_a_miss_is_printed_as_a_miss():
    console = screen_console()
    with console.capture() as printed:
        console.print(
            table_of("x", [
                Row("slow", 173.2, "Msps", 200.0, "more", 20, like_for_like=226.7),
                Row("fast", 205.0, "Msps", 200.0, "more", 20, like_for_like=150.0),
            ])
        )  # fmt: skip
    slow, fast = printed.get().splitlines()[-3:-1]
    assert "173.2 Msps (226.7)" in slow
    assert "≥ 200 missed" in slow
    assert "missed" not in fast


def test_a_table_tells_what_its_rows_include():
    console = screen_console()
    with console.capture() as printed:
        console.print(
            table_of("x", [Row("a", 1.0, "s", None, "less", 1, includes="the line"),
                           Row("b", 1.0, "s", None, "less", 1)])
        )  # fmt: skip
    a, b = printed.get().splitlines()[-3:-1]
    assert "a: the line" in a
    assert ":" not in b


def test_rows_are_exact_only_where_somebody_says_so():
    row, drawing = Row("x", 1.0, "s", None, "less", 1), Drawing("picture", {})
    assert not row.exact
    assert list(exactly([row, drawing])) == [row, drawing]
    assert row.exact


def run(monkeypatch, capsys, measure):
    """(exit code, JSON, complaints)."""
    monkeypatch.setattr(sys, "argv", ["x", "--json"])
    code = report.main("x", measure)
    out, err = capsys.readouterr()
    return code, json.loads(out), err


def measured(error, target=1.0):
    def measure(seed, quick):
        yield Row("first", 1.0, "s", target, "less", 1)
        with attempt("a peer"):
            raise PeerError("a peer: is\nnot there")
        yield Row("second", 2.0, "s", None, "less", 1)
        if error:
            raise error

    return measure


def test_what_could_be_measured_is_kept(monkeypatch, capsys):
    code, told, err = run(monkeypatch, capsys, measured(ProcessError("the daemon has ended")))
    assert code == 2
    assert [row["name"] for row in told["rows"]] == ["first", "second"]
    assert told["not_measured"] == {
        "a peer": "is not there", "the rest": "the daemon has ended",
    }  # fmt: skip
    assert err == (
        "not measured: a peer: is not there\nnot measured: the rest: the daemon has ended\n"
    )


def test_a_peer_that_is_not_there_is_no_failure(monkeypatch, capsys):
    assert run(monkeypatch, capsys, measured(None))[0] == 0
    assert run(monkeypatch, capsys, measured(None, target=0.5))[0] == 1
    assert run(monkeypatch, capsys, lambda *_: [])[0] == 2


def test_a_bug_of_ours_is_told_as_one_and_loses_no_row(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["x", "--json"])
    with pytest.raises(ZeroDivisionError):
        report.main("x", measured(ZeroDivisionError()))
    assert len(json.loads(capsys.readouterr().out)["rows"]) == 2


@pytest.mark.parametrize(("program", "says"), [
    ("", "no C compiler"), ("echo oh >&2; exit 1", "oh"), ("exit 1", "exit code 1"),
    ("exit 0", "No such file"),
])  # fmt: skip
def test_modems_that_cannot_be_measured_are_left_out(monkeypatch, capsys, tmp_path, program, says):
    """No compiler, one that fails, one without output; and a GNU Radio that is not a program."""
    if program:
        (tmp_path / "gcc").write_text(f"#!/bin/sh\n{program}\n")
        (tmp_path / "gcc").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(gnu_radio, "PYTHON", "/nonexistent/python3")
    peers = phy_speed.measure_peers(1)
    assert (peers.liquid, peers.gnuradio, peers.noise) == ({}, {}, {})
    liquid, gnuradio = capsys.readouterr().err.splitlines()
    assert liquid.startswith("not measured: liquid-dsp: ")
    assert says in liquid
    assert gnuradio.startswith("not measured: GNU Radio: ")
    assert "/nonexistent/python3" in gnuradio


@pytest.mark.parametrize(("printed", "says"), [("echo", "printed nothing"), ("echo soon", "soon")])
def test_a_modem_that_talks_nonsense_is_left_out(monkeypatch, capsys, tmp_path, printed, says):
    python = tmp_path / "python3"
    python.write_text(f"#!/bin/sh\n{printed}\n")
    python.chmod(0o755)
    monkeypatch.setattr(gnu_radio, "PYTHON", str(python))
    with attempt("GNU Radio"):
        gnu_radio.GnuRadio().noise_msps(10, 1)
    assert says in capsys.readouterr().err


def test_a_peer_that_fails_in_its_second_pass_keeps_its_first(monkeypatch, capsys):
    def measured_by(name, *, seed, **_):
        if name == "xrce" and seed == 2:
            raise ProcessError("fcu has ended: no output, exit code 1")
        if name == "mavlink":
            raise PeerError("mavlink: pip install: no network")
        return f"{name}{seed}"

    monkeypatch.setattr(rows, "run", measured_by)
    found = rows.sessions(1, 1.0, 3, of=("mavlink", "xrce", "direct"))
    assert found == {"xrce": ["xrce1"], "direct": ["direct1", "direct2", "direct3"]}
    assert capsys.readouterr().err == (
        "not measured: mavlink: pip install: no network\n"
        "not measured: xrce: fcu has ended: no output, exit code 1\n"
    )


def test_a_peer_whose_environment_cannot_be_made_is_left_out(monkeypatch, capsys, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert rows.sessions(1, 1.0, 1, of=("mavlink", "mavros")) == {}
    mavlink, mavros = capsys.readouterr().err.splitlines()
    assert mavlink.startswith("not measured: mavlink: ")
    assert mavros.startswith("not measured: mavros: ")
    assert "Not a directory" in mavlink


def test_peers_of_pound_go_on_without_one(capsys):
    def one(name):
        if name == "udp":
            raise OSError("no such tool")
        return 1.0

    assert beside.each(["tcp", "udp", "zenoh"], "outage", one) == {"tcp": 1.0, "zenoh": 1.0}
    assert "not measured: udp, outage: no such tool\n" in capsys.readouterr().err


@pytest.mark.long
def test_a_benchmark_goes_on_where_no_program_is_found():
    """The whole benchmark, without a compiler for liquid-dsp."""
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.phy_speed", "--quick", "--json"],
        cwd=ROOT, env={**os.environ, "PATH": "/nonexistent"}, capture_output=True, text=True,
        timeout=240,
    )  # fmt: skip
    told = json.loads(done.stdout)
    assert len(told["rows"]) == 7
    assert "no C compiler" in told["not_measured"]["liquid-dsp"]
    assert "Traceback" not in done.stderr
