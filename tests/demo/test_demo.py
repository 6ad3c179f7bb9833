"""The demonstration, run for real."""

import json

import pytest

from sdrlinkd.cli import run
from sdrlinkd.demo import Options, open_source, run_demo
from tests.adapters.recordings import STORAGES, noisy_messages, ros2_bag


def demo(*arguments):
    return run(["demo", *(str(argument) for argument in arguments)])


@pytest.mark.parametrize("pdu_size", [64, 1024])
def test_everything_arrives_unchanged(tmp_path, pdu_size):
    code = demo("--duration", 4, "--speed", 4, "--pdu-size", pdu_size, "--out", tmp_path, "--json",
                tmp_path / "copy.json")  # fmt: skip
    assert code == 0
    report = json.loads((tmp_path / "report.json").read_text())
    assert report == json.loads((tmp_path / "copy.json").read_text())
    (result,) = report["runs"]
    assert (result["name"], result["sent"], result["received"]) == ("direct", 400, 400)
    assert (result["pdr"], result["bytes_identical"], result["path_error_m"]) == (1.0, True, 0.0)
    assert result["ledger_adds_up"]
    assert result["dropped"] == {}
    assert result["goodput_bytes_per_s"] > 100_000
    assert set(result["latency_ms"]) == {"p50", "p90", "p99", "max"}
    assert {topic["name"]: topic["sent"] for topic in result["topics"]} == {
        "odom": 120, "imu": 200, "scan": 40, "cmd_vel": 40,
    }  # fmt: skip
    for name in ("latency_cdf.png", "path.png"):
        picture = (tmp_path / name).read_bytes()
        assert picture.startswith(b"\x89PNG")
        assert len(picture) > 5000


@pytest.mark.parametrize("pdu_size", [64, 1024])
def test_a_run_adds_up(pdu_size):
    seen = []
    source = open_source(None, None, [], 2.0, 1)
    result, trace = run_demo(
        source, Options("direct", pdu_size, 4.0, 1), lambda *counts: seen.append(counts)
    )
    assert (result.sent, result.received, result.pdr) == (200, 200, 1)
    assert result.bytes_identical
    assert result.ledger_adds_up
    assert (result.path_error_m, result.dropped, result.pdu_size) == (0, {}, pdu_size)
    assert result.pdus_sent > 0
    assert 0.4 < result.duration_s < 10
    for name, samples in trace.sent.items():
        assert [s.payload for s in trace.received[name]] == [s.payload for s in samples]
    assert seen == sorted(seen)
    assert seen[-1] == (200, 200)


def test_a_picture_that_cannot_be_written_is_told_in_words(tmp_path, capsys):
    (tmp_path / "path.png").mkdir()
    assert demo("--duration", 0.2, "--out", tmp_path) == 2
    assert "path.png" in capsys.readouterr().err


@pytest.mark.parametrize("storage", STORAGES)
def test_a_bag_with_garbage_in_its_padding_arrives_unchanged(tmp_path, storage, capsys):
    bag = ros2_bag(
        tmp_path / "bag", STORAGES[storage],
        [(t, k, ns * 1000, cdr) for t, k, ns, cdr in noisy_messages(5, 120) if t == "/chat"],
    )  # fmt: skip
    assert demo("--bag", bag, "--out", tmp_path / "out") == 0
    (result,) = json.loads((tmp_path / "out/report.json").read_text())["runs"]
    assert (result["pdr"], result["bytes_identical"], result["path_error_m"]) == (1.0, True, None)


def test_bad_input_is_refused_in_words(tmp_path, capsys):
    (tmp_path / "junk.mcap").write_bytes(b"junk")
    (tmp_path / "file").write_text("")
    (tmp_path / "many.csv").write_text("".join(f"t{i},a/B\n" for i in range(17)))
    (tmp_path / "twice.csv").write_text("odom,a/B\nodom,a/B\n")
    for arguments, says in (
        (("--bag", tmp_path / "none"), "no such file"),
        (("--bag", tmp_path / "junk.mcap"), "cannot be read"),
        (("--topics", "/none"), "allowed: /robot_1/cmd_vel"),
        (("--registry", tmp_path / "many.csv"), "17 topics"),
        (("--registry", tmp_path / "twice.csv"), "twice.csv:2: topic odom is listed twice"),
        (("--registry", tmp_path / "none.csv"), "cannot be read"),
        (("--duration", "0.1", "--out", tmp_path / "file"), "cannot be written"),
    ):
        assert demo(*arguments) == 2, arguments
        out, err = capsys.readouterr()
        assert says in err, arguments
        assert err.count("\n") == 1, err
        assert "Traceback" not in out + err
    assert demo("--pdu-size", "7") == 2
    assert demo("--link", "carrier-pigeon") == 2
