"""The demonstration, run for real."""

import json
import sys

import pytest

from sdrlinkd.cli import run
from sdrlinkd.demo import Options, open_source, run_demo, write_config
from sdrlinkd.demo.testing import WRITE_CONFIG
from sdrlinkd.drive import read_drive
from sdrlinkd.extras import hint
from tests.adapters.recordings import STORAGES, noisy_messages, ros2_bag
from tests.laws import one_in


def demo(*arguments):
    return run(["demo", *(str(argument) for argument in arguments)])


@pytest.mark.realtime(most_s=20)
def test_the_whole_of_table_6(tmp_path, capsys):
    written = ("--out", tmp_path, "--json", tmp_path / "copy.json")
    code = demo("--duration", 2, *written, "--record", tmp_path / "recording")
    assert code == 0
    report = json.loads((tmp_path / "report.json").read_text())
    assert report == json.loads((tmp_path / "copy.json").read_text())
    assert [run["name"] for run in report["runs"]] == ["ofdm", "iqfile", "direct"]
    for result in report["runs"]:
        assert (result["sent"], result["received"], result["pdr"]) == (200, 200, 1.0), result
        assert (result["bytes_identical"], result["path_error_m"]) == (True, 0.0)
        assert result["ledger_adds_up"]
        assert result["dropped"] == {}
        assert result["goodput_bytes_per_s"] > 0
        assert list(result["latency_ms"]) == ["p50", "p90", "p99", "max"]
        late_ms = list(result["latency_ms"].values())
        assert late_ms == sorted(late_ms)
        assert late_ms[0] > 0
        assert {topic["name"]: topic["sent"] for topic in result["topics"]} == {
            "odom": 60, "imu": 100, "scan": 20, "cmd_vel": 20,
        }  # fmt: skip
    ofdm, iqfile, direct = report["runs"]
    assert direct["phy"] is None
    for result in (ofdm, iqfile):
        heard = result["phy"]
        assert (heard["mcs"], heard["channel"]) == ("QPSK 1/2", "awgn")
        # The last beacon may have been heard, while its sender does not know yet that it left.
        assert heard["pdus_good"] - result["pdus_sent"] in (0, 1)
        assert heard["pdus_bad"] == heard["headers_bad"] == 0
        assert 14 < heard["snr_db_measured"] < 16
    for name in ("latency_cdf.png", "path.png"):
        picture = (tmp_path / name).read_bytes()
        assert picture.startswith(b"\x89PNG")
        assert len(picture) > 5000
    for name, receiver in (("ofdm", 1), ("iqfile", 2), ("direct", 1)):
        kept = read_drive(tmp_path / name)
        told = kept.stations[receiver].deliveries
        assert {topic: each.delivered for (src, topic), each in told.items() if src == 1} == {
            "/odom": 60, "/imu": 100, "/scan": 20, "/cmd_vel": 20,
        }  # fmt: skip
        assert {key: len(path) for key, path in kept.paths.items()} == {
            (1, None): 60, (1, receiver): 60,
        }  # fmt: skip
        assert "Delivery" in (tmp_path / name / "report.html").read_text()
    out = capsys.readouterr().out
    assert "0.01" in out
    assert "228.6" in out
    assert (tmp_path / "recording.sigmf-meta").is_file()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("link", "pdu_size", "speed"),
    one_in(2, [("direct", 64, 4.0), ("direct", 1024, 4.0), ("ofdm", 1024, 1.0)]),
)
def test_a_run_adds_up(link, pdu_size, speed):
    seen = []
    source = open_source(None, None, [], 2.0, 1)
    result, trace = run_demo(
        source,
        Options(link=link, pdu_size=pdu_size, speed=speed),
        lambda *counts: seen.append(counts),
    )
    assert (result.sent, result.received, result.pdr) == (200, 200, 1)
    assert result.bytes_identical
    assert result.ledger_adds_up
    assert (result.path_error_m, result.dropped, result.pdu_size) == (0, {}, pdu_size)
    assert result.pdus_sent > 0
    assert 0.4 < result.duration_s < 20
    for name, samples in trace.sent.items():
        assert [s.payload for s in trace.received[name]] == [s.payload for s in samples]
    assert seen == sorted(seen)
    assert seen[-1] == (200, 200)


@pytest.mark.slow
def test_noise_beyond_the_code_loses_messages_by_name():
    source = open_source(None, None, [], 2.0, 1)
    options = Options(link="ofdm", pdu_size=220, snr_db=0.0)
    result, _ = run_demo(source, options, lambda *_: None)
    assert result.pdr < 0.9
    assert result.phy.pdus_bad > 0
    assert result.ledger_adds_up
    assert result.received == 0 or result.bytes_identical


@pytest.mark.long
def test_every_mcs_can_be_shown(tmp_path):
    arguments = ("--link", "ofdm", "--rate", 2e6, "--duration", 0.5, "--out", tmp_path)
    assert demo("--mcs", 9, "--snr", 35, *arguments) == 0
    (result,) = json.loads((tmp_path / "report.json").read_text())["runs"]
    assert (result["phy"]["mcs"], result["pdr"]) == ("256QAM 5/6", 1.0)


@pytest.mark.long
def test_a_clean_link_that_loses_messages_is_a_fault(tmp_path, monkeypatch, capsys):
    def lossy(*arguments):
        path = write_config(*arguments)
        path.write_text(path.read_text() + "[direct]\nloss = 0.5\n")
        return path

    monkeypatch.setattr(*WRITE_CONFIG, lossy)
    arguments = ("--link", "direct", "--duration", 0.5, "--out", tmp_path)
    assert demo(*arguments) == 1
    (told,) = [line for line in capsys.readouterr().out.splitlines() if "did not arrive" in line]
    assert told.startswith("direct: ")


def test_a_picture_that_cannot_be_written_is_told_in_words(tmp_path, capsys):
    (tmp_path / "path.png").mkdir()
    assert demo("--duration", 0.2, "--link", "direct", "--out", tmp_path) == 2
    assert "path.png" in capsys.readouterr().err


@pytest.mark.slow
def test_without_matplotlib_the_table_is_there_and_how_to_get_pictures(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    arguments = ("--duration", 0.5, "--link", "direct", "--out", tmp_path)
    assert demo(*arguments) == 0
    *shown, last = capsys.readouterr().out.splitlines()
    assert any(line.startswith(" direct ") for line in shown)
    assert last == hint("plots")
    assert {path.name for path in tmp_path.rglob("*.*")} == {"report.json", "drive.mcap"}


@pytest.mark.long
def test_a_bag_whose_names_have_no_slash_is_sent(tmp_path):
    messages = [("fix", "std_msgs/msg/String", 1_000_000 * i, bytes(12)) for i in range(20)]
    bag = ros2_bag(tmp_path / "bag", STORAGES["mcap"], messages)
    assert demo("--bag", bag, "--link", "direct", "--out", tmp_path / "out") == 0
    (result,) = json.loads((tmp_path / "out/report.json").read_text())["runs"]
    assert (result["sent"], result["received"], result["topics"][0]["name"]) == (20, 20, "fix")


@pytest.mark.slow
@pytest.mark.parametrize("storage", STORAGES)
def test_a_bag_with_garbage_in_its_padding_arrives_unchanged(tmp_path, storage, capsys):
    bag = ros2_bag(
        tmp_path / "bag", STORAGES[storage],
        [(t, k, ns * 1000, cdr) for t, k, ns, cdr in noisy_messages(5, 120) if t == "/chat"],
    )  # fmt: skip
    assert demo("--bag", bag, "--link", "direct", "--out", tmp_path / "out") == 0
    (result,) = json.loads((tmp_path / "out/report.json").read_text())["runs"]
    assert (result["pdr"], result["bytes_identical"], result["path_error_m"]) == (1.0, True, None)


@pytest.mark.slow
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
        (("--registry", tmp_path / "none.csv"), "is unreadable"),
        (("--duration", "0.1", "--out", tmp_path / "file"), "cannot be written"),
    ):
        assert demo(*arguments) == 2, arguments
        out, err = capsys.readouterr()
        assert says in err, arguments
        assert err.count("\n") == 1, err
        assert "Traceback" not in out + err
    assert demo("--pdu-size", "7") == 2
    assert demo("--link", "carrier-pigeon") == 2
    assert demo("--mcs", "10") == 2
    assert demo("--channel", "vacuum") == 2
