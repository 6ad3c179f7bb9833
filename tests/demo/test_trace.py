"""The paper's figures of merit, calculated by hand."""

import numpy as np
import pytest

from sdrlinkd.demo import Options, Sample, Trace, latency_ms, open_source
from sdrlinkd.demo.testing import goodput_bytes_per_s, path_error_m, run_result, topic_results
from sdrlinkd.errors import RegistryError, UserError
from tests.adapters.recordings import STORAGES, ros2_bag


def trace_of(sent, received):
    trace = Trace({"a": "std_msgs/msg/String"})
    trace.sent["a"] = [Sample(at, payload) for at, payload in sent]
    trace.received["a"] = [Sample(at, payload) for at, payload in received]
    return trace


def test_pairs_under_loss_and_equal_payloads():
    trace = trace_of(
        [(0, b"x"), (1, b"x"), (2, b"y"), (3, b"z")], [(0.1, b"x"), (1.1, b"x"), (3.1, b"z")]
    )
    pairs, foreign = trace.matches()
    assert [(was.at, got.at) for was, got in pairs["a"]] == [(0, 0.1), (1, 1.1), (3, 3.1)]
    assert foreign == 0


def test_what_nobody_sent_is_foreign_and_so_is_a_copy():
    trace = trace_of([(0, b"x")], [(0.1, b"x"), (0.2, b"x"), (0.3, b"?")])
    assert trace.matches()[1] == 2


def test_equal_payloads_lost_at_the_end():
    trace = trace_of([(0, b"x"), (1, b"x"), (2, b"x")], [(0.1, b"x"), (1.1, b"x")])
    pairs, foreign = trace.matches()
    assert [(was.at, got.at) for was, got in pairs["a"]] == [(0, 0.1), (1, 1.1)]
    assert foreign == 0


def test_a_copy_of_distinct_payloads_costs_no_other_its_pair():
    trace = trace_of(
        [(0, b"x"), (1, b"y"), (2, b"z")], [(0.1, b"x"), (0.2, b"x"), (1.1, b"y"), (2.1, b"z")]
    )
    pairs, foreign = trace.matches()
    assert [(was.at, got.at) for was, got in pairs["a"]] == [(0, 0.1), (1, 1.1), (2, 2.1)]
    assert foreign == 1


def test_nothing_arrives_before_it_is_sent():
    trace = trace_of(
        [(0, b"x"), (1, b"y"), (2, b"x")], [(0.1, b"x"), (0.2, b"x"), (1.1, b"y"), (2.1, b"x")]
    )
    pairs, foreign = trace.matches()
    assert [(was.at, got.at) for was, got in pairs["a"]] == [(0, 0.1), (1, 1.1), (2, 2.1)]
    assert foreign == 1


def test_topics_are_told_apart():
    trace = Trace({"a": "std_msgs/msg/String", "b": "std_msgs/msg/String"})
    trace.sent["a"] = [Sample(0, b"x")]
    trace.received["b"] = [Sample(0.1, b"x")]
    assert trace.matches() == ({"b": []}, 1)
    assert [(r.name, r.received, r.pdr, r.latency_ms) for r in topic_results(trace)] == [
        ("a", 0, 0, {})
    ]


def finished(trace):
    source = open_source(None, None, [], 1.0, 7)
    source.left_out = ["/b: none"]
    return run_result(
        trace, source=source, options=Options(link="direct"), duration_s=2.5, pdus_sent=30,
        entries=20, dropped={"tx_stale": 1}, ledger_adds_up=True,
    )  # fmt: skip


def test_a_run_with_loss():
    result = finished(trace_of([(i, bytes([i]) * 10) for i in range(4)], [(0.5, b"\0" * 10)]))
    assert (result.sent, result.received, result.pdr) == (4, 1, 0.25)
    assert result.bytes_identical
    assert result.entries_per_message == 5
    assert result.goodput_bytes_per_s == 20
    assert result.latency_ms == {"p50": 500, "p90": 500, "p99": 500, "max": 500}
    assert result.path_error_m is None
    assert (result.dropped, result.left_out) == ({"tx_stale": 1}, ["/b: none"])


def test_bytes_are_identical_only_if_all_that_arrived_was_sent():
    assert not finished(trace_of([(0, b"x")], [(0.1, b"x"), (0.2, b"?")])).bytes_identical
    nothing = finished(trace_of([(0, b"x")], []))
    assert (nothing.bytes_identical, nothing.pdr, nothing.latency_ms) == (False, 0, {})
    assert finished(Trace({})).pdr == 0


def test_latency_quantiles_by_hand():
    pairs = [(Sample(0, b""), Sample(i / 1000, b"")) for i in range(101)]
    assert latency_ms(pairs[::-1]) == pytest.approx({"p50": 50, "p90": 90, "p99": 99, "max": 100})


def test_latency_goodput_and_pdr():
    trace = trace_of(
        [(i, bytes([i]) * 100) for i in range(10)],
        [(i + 0.01 * i, bytes([i]) * 100) for i in range(9)],
    )
    (result,) = topic_results(trace)
    assert (result.sent, result.received, result.pdr) == (10, 9, 0.9)
    assert result.latency_ms["p50"] == pytest.approx(40)
    assert result.latency_ms["max"] == pytest.approx(80)
    assert result.goodput_bytes_per_s == pytest.approx(900 / 8.08)
    assert latency_ms([]) == {}
    assert goodput_bytes_per_s([]) == 0


def test_path_error_by_hand():
    line = np.stack([np.linspace(0, 10, 50), np.zeros(50)], axis=1)
    assert path_error_m(line, line) == 0
    assert path_error_m(line, line + np.array((0, 0.3))) == pytest.approx(0.3)
    assert path_error_m(line, line[::7]) == pytest.approx(0, abs=1e-9)
    assert path_error_m(line[[0, -1]], line) == pytest.approx(0, abs=1e-9)
    # A path that ends half way: the mean distance of points at equal fractions of the length.
    assert path_error_m(line, line * [0.5, 1]) == pytest.approx(2.5, rel=1e-3)
    assert path_error_m(line, line[:1]) is None
    assert path_error_m(line, np.zeros((5, 2))) is None
    assert path_error_m(line, np.zeros((0, 2))) is None


def test_path_error_of_a_corner():
    corner = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 4.0)])
    assert path_error_m(corner, corner + (3, 4)) == pytest.approx(5)  # noqa: RUF005
    # At fraction t < 1/2 the corner is at (8t, 0) and its diagonal at (4t, 4t): 4√2·t apart, mean
    # √2.
    assert path_error_m(corner, corner[[0, 2]]) == pytest.approx(np.sqrt(2), rel=2e-3)


def string_bag(path, topics):
    return ros2_bag(
        path, STORAGES["sqlite3"],
        [(t, "std_msgs/msg/String", i, b"\0\1\0\0") for t, n in topics for i in range(n)],
    )  # fmt: skip


def test_the_fifteen_busiest_topics_make_a_registry(tmp_path):
    bag = string_bag(tmp_path / "bag", [(f"/t{i:02}", i + 1) for i in range(18)])
    source = open_source(bag, None, [], None, 1)
    assert len(source.registry) == 15
    assert source.registry.has_control
    assert [reason.split(":")[0] for reason in source.left_out] == ["/t02", "/t01", "/t00"]


def test_topics_can_be_chosen(tmp_path):
    bag = string_bag(tmp_path / "bag", [("/a", 2), ("/b", 3)])
    source = open_source(bag, None, ["b"], None, 1)
    assert [m.topic for m in source.messages()] == ["/b"] * 3
    with pytest.raises(UserError, match="allowed: /a, /b"):
        open_source(bag, None, ["/c"], None, 1)
    assert [t.name for t in open_source(None, None, ["odom"], 1, 1).topics] == ["/robot_1/odom"]


def test_what_the_registry_lacks_is_left_out_by_name(tmp_path):
    bag = string_bag(tmp_path / "bag", [("/a", 2), ("/b", 3), ("/c", 1)])
    registry = tmp_path / "r.csv"
    registry.write_text("a,std_msgs/String\nb,std_msgs/Bool\n")
    source = open_source(bag, registry, [], None, 1)
    assert [t.name for t in source.topics] == ["/a"]
    assert source.left_out == [
        "/b: type std_msgs/msg/String, but the registry has std_msgs/msg/Bool",
        "/c: not in the registry",
    ]  # fmt: skip
    registry.write_text("".join(f"t{i},a/B\n" for i in range(17)))
    with pytest.raises(RegistryError, match="17 topics"):
        open_source(bag, registry, [], None, 1)
