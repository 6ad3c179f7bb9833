"""A peer or a daemon that cannot start: it is named, and all that was measured is kept."""

import json
import sys
from types import SimpleNamespace

import pytest

from benchmarks import absent, daemons, report
from benchmarks.absent import PeerError
from benchmarks.flows import Flow
from benchmarks.peers.pound import ends
from benchmarks.peers.pound.namespaces import Network, Node
from benchmarks.pound import __main__ as pound
from benchmarks.pound import beside, limits, realtime
from benchmarks.report import Row
from tests.benchmarks_pound.machine import in_namespaces

BROKEN = "libzenohc.so: cannot open shared object file"


@pytest.fixture(autouse=True)
def nothing_told():
    absent.forget()


@pytest.fixture
def broken_zenoh(monkeypatch, tmp_path):
    """An interpreter for Zenoh's ends that starts and fails at once."""
    python = tmp_path / "python3"
    python.write_text(f"#!/bin/sh\necho 'ImportError: {BROKEN}' >&2\nexit 1\n")
    python.chmod(0o755)
    of = ends.interpreter
    monkeypatch.setattr(
        ends, "interpreter", lambda name: str(python) if name == "zenoh" else of(name)
    )
    for module in (ends, beside):
        monkeypatch.setattr(module, "unavailable", lambda _: None)


class Here(Node):
    """A node that is no namespace."""

    def command(self, *words):
        return [*words]


def run(monkeypatch, capsys, measure):
    monkeypatch.setattr(sys, "argv", ["x", "--json", "--quick"])
    code = report.main("pound", measure)
    out, err = capsys.readouterr()
    return code, json.loads(out), err


def test_a_peer_that_does_not_start_is_named_and_costs_no_row(monkeypatch, capsys, broken_zenoh):
    on = Network(Here("a", "127.0.0.1"), Here("b", "127.0.0.2"), None, 6e6, shared=True)
    flows = [Flow("laser", 1024, 0.02, 5, "latency")]

    def measure(target):
        def one(seed, quick):
            yield Row("before", 2.0, "ms", target, "less", 1)
            peers = beside.each(
                ["zenoh_drop", "tcp_nodelay"], "one hop",
                lambda name: len(beside.run_peer(name, flows, on, 1, drain_s=0.2)),
            )  # fmt: skip
            yield Row("after", 1.0, "ms", 1.0, "less", 1, dict(peers))

        return one

    for target, expected in ((2.0, 0), (1.0, 1)):
        code, told, err = run(monkeypatch, capsys, measure(target))
        assert [row["name"] for row in told["rows"]] == ["before", "after"]
        assert told["rows"][1]["peers"] == {"tcp_nodelay": 1}
        assert BROKEN in told["not_measured"]["zenoh_drop, one hop"]
        assert code == expected
    assert "Traceback" not in err


@pytest.mark.long
def test_daemons_that_do_not_start_cost_their_own_rows_only(monkeypatch, capsys):
    """The first pair of daemons ends at once; the one daemon works, until its second pass."""
    made = []

    def limited(ends, seed, quick):
        if made:
            raise PeerError("the daemon has ended")
        made.append(seed)
        return [Row("urgent", 1.0, "ms", 1.0, "less", 1)]

    @daemons.contextmanager
    def running(backend, nodes, outages=()):
        if outages:
            with daemons.running(backend, nodes, ["laser"], "[modem]\nrate_hz = 'soon'\n", ""):
                raise AssertionError("a daemon starts with a configuration that is none")
        yield SimpleNamespace()

    monkeypatch.setattr(realtime, "running", running)
    monkeypatch.setattr(realtime, "SLEEPS", 1)
    monkeypatch.setattr(
        realtime, "table_rows", lambda *_: [Row("laser", 3.0, "ms", 2.0, "less", 1)]
    )
    monkeypatch.setattr(realtime, "limit_rows", limited)
    rows = list(realtime.rows(1, quick=False))
    assert [(row.name, row.trials, row.ok) for row in rows] == [
        ("laser", 1, False), ("urgent", 1, True),
    ]  # fmt: skip
    assert rows[0].peers == {"two daemons and a hub": 3.0}
    assert set(absent.told()) == {"two daemons and an outage", "a daemon that hears itself"}
    assert "rate_hz" in absent.told()["two daemons and an outage"]


@pytest.mark.long
@in_namespaces
def test_the_whole_benchmark_goes_on_without_a_peer(monkeypatch, capsys, broken_zenoh):
    monkeypatch.setattr(beside, "QUICK", ("zenoh_drop", "tcp_nodelay"))
    monkeypatch.setattr(beside, "LOOP_S", 0.5)
    monkeypatch.setattr(limits, "SIZES", (65536,))
    monkeypatch.setattr(realtime, "rows", lambda *_: [])
    code, told, err = run(monkeypatch, capsys, pound.measure)
    rows = {row["name"]: row for row in told["rows"]}
    assert {"laser_2n_D_ms", "laser_1ch_D_ms", "table5_3n_s", "plan_error_pct"} <= set(rows)
    assert "tcp_nodelay" in rows["laser_2n_D_ms"]["peers"]
    assert "tcp_nodelay_laser_first" in rows["laser_1ch_D_ms"]["peers"]
    assert not any("zenoh_drop" in row["peers"] for row in rows.values())
    for what in ("one hop", "two hops", "one channel", "control loop"):
        assert BROKEN in told["not_measured"][f"zenoh_drop, {what}"]
    assert code == 1, "rows that miss their targets are still told"
    assert "Traceback" not in err
