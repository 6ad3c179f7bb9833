"""`sdrlinkctl lab`: one command runs a scenario; report and figures are in a folder."""

import sys
import time
from pathlib import Path

import msgspec
import pytest

from backends import HubWatch
from sdrlinkd.cli import run
from sdrlinkd.cli.pace import scenario_names
from sdrlinkd.drive import read_drive
from sdrlinkd.extras import hint
from sdrlinkd.lab import LabReport, find_scenario
from sdrlinkd.lab.testing import Listener
from tests.conftest import ETC
from tests.lab.reports import report, robot
from tests.lab.scenarios import write_scenario

LISTENING_ROBOT = """
[[robot]]
id = 1
topics = ["cmd_vel"]

[[robot]]
id = 2
topics = ["cmd_vel"]
sends = false
"""
# Whole tenths, with a pause before each border for messages in flight.
OUTAGE = "[outages]\ntimes = [[0.76, 1.16]]\n[daemon.repeat]\nshare = 0.0\n"


@pytest.fixture
def late(monkeypatch):
    """The lab starts late to listen to robot 2: the air has to wait for it."""
    begin = Listener.__init__

    def begin_late(listener, directory, by_age):
        if directory.name == "robot_2":
            give_up_at = time.monotonic() + 1.0
            with HubWatch(directory.parent / "hub") as watch:
                # Without effect if the air waits.
                while watch.ask().now_s < 0.5 and time.monotonic() < give_up_at:
                    pass
        begin(listener, directory, by_age)

    monkeypatch.setattr(Listener, "__init__", begin_late)


@pytest.fixture
def lab(capsys, tmp_path):
    """Runs `sdrlinkctl lab`; (exit code, stdout, stderr). No traceback is allowed."""

    def call(*arguments):
        code = run(["lab", *(str(each) for each in arguments), "--out", str(tmp_path / "out")])
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return code, out, err

    return call


@pytest.fixture
def come_to(monkeypatch):
    """Replace runs by a given report; returns the arguments of the calls."""
    seen = []

    def come_to(made):
        def pretend(options, watch, keep):
            seen.append(options)
            return made

        monkeypatch.setattr("sdrlinkd.cli.lab.run_lab", pretend)
        # Takes a second, and has separate tests.
        monkeypatch.setattr("sdrlinkd.lab.pictures.draw", lambda *_: None)
        monkeypatch.setattr("sdrlinkd.cli.lab.write_page", lambda *_: None)
        return seen

    return come_to


@pytest.fixture
def asked(come_to):
    """The arguments of a run, which does not take place."""
    return come_to(report())


@pytest.mark.slow
def test_a_run_is_told_drawn_and_written(lab, tmp_path, late):
    path = write_scenario(tmp_path, robots=LISTENING_ROBOT, extra=OUTAGE)
    code, out, _ = lab(path, "--duration", 2, "--seed", 5)
    assert code == 0
    made = msgspec.json.decode((tmp_path / "out/report.json").read_bytes(), type=LabReport)
    assert (made.scenario, made.pace, made.duration_s, made.seed) == ("small", "lockstep", 2.0, 5)
    picture = (tmp_path / "out/lab.png").read_bytes()
    assert picture.startswith(b"\x89PNG")
    assert len(picture) > 5000
    # Robot 2 only listens, and hears everything but what is sent in the outage.
    (pair,) = made.pairs
    assert (pair.sender, pair.receiver, pair.sent) == (1, 2, 20)
    assert pair.pdr_tenths == [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]
    assert pair.bytes_identical
    sender, listener = made.robots
    assert sender.ledger_adds_up
    assert listener.ledger_adds_up
    # It only announces itself.
    assert 0 < listener.bursts_sent < 6 < sender.bursts_sent
    assert "Two small robots: delivery by pair" in out
    assert "PDR 0.8000 in all, 0.8000 at worst; in lock-step" in out
    assert "robot 2: tdma: 2 slots" in out
    assert "out/report.json, lab.png, drive.mcap, report.html" in out
    drive = read_drive(tmp_path / "out")
    assert set(drive.stations) == {1, 2}
    assert drive.lasted_s == pytest.approx(2.0, abs=1.0)
    assert drive.pdr(2, 1, "/cmd_vel") == pytest.approx(0.8)


def test_options_go_before_the_scenario(lab, asked, tmp_path):
    path = write_scenario(tmp_path)
    arguments = ("--duration", "1.5", "--seed", 9, "--pace", "realtime", "--access", "csma")
    code, _, _ = lab(path, *arguments, "--bag", tmp_path / "bag", "--traces", tmp_path)
    assert code == 0
    (options,) = asked
    scenario = options.scenario
    assert (scenario.duration_s, scenario.seed, scenario.pace) == (1.5, 9, "realtime")
    assert scenario.daemon == {"modem": {"mcs": 2}, "access": {"policy": "csma", "force": True}}
    assert (options.path, options.bag, options.traces) == (path, tmp_path / "bag", tmp_path)


def test_without_jinja_there_is_no_page_and_the_last_line_says_how_to_get_it(
    lab, asked, tmp_path, monkeypatch
):
    monkeypatch.setitem(sys.modules, "jinja2", None)
    code, out, _ = lab(write_scenario(tmp_path))
    *_, wrote, last = out.splitlines()
    assert (code, wrote.endswith("out/report.json, drive.mcap"), last) == (0, True, hint("plots"))
    assert not (tmp_path / "out/lab.png").exists()


def test_without_options_the_scenario_is_as_written(lab, asked, tmp_path):
    path = write_scenario(tmp_path, top='seed = 4\nbag = "recordings/a"\n', extra="slot_s = 0.1\n")
    assert lab(path)[0] == 0
    assert lab(path, "--access", "none")[0] == 0
    plain, changed = asked
    assert (plain.scenario.duration_s, plain.scenario.seed) == (1.5, 4)
    assert (plain.scenario.pace, plain.traces) == ("lockstep", None)
    assert plain.bag == tmp_path / "recordings/a"
    assert plain.scenario.daemon["access"] == {"policy": "tdma", "slot_s": 0.1}
    assert changed.scenario.daemon["access"] == {"policy": "none", "slot_s": 0.1, "force": True}


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("--access", "aloha"), ["--access", "aloha", "none", "csma", "minislot", "tdma"]),
        (("--pace", "fast"), ["--pace", "fast", "realtime", "lockstep"]),
        (("--duration", "0"), ["--duration", "0.5"]),
        (("--duration", "nan"), ["--duration"]),
        (("--seed", "-1"), ["--seed"]),
        (("--seed", "99999999999999999999"), ["--seed"]),
    ],
)
def test_an_option_that_cannot_be_says_what_is_allowed(lab, asked, tmp_path, arguments, parts):
    code, _, err = lab(write_scenario(tmp_path), *arguments)
    assert code == 2
    assert asked == []
    for part in parts:
        assert part in err


def test_what_cannot_be_read_or_written_is_told_before_the_run(lab, asked, tmp_path):
    (tmp_path / "bad.toml").write_text("[[robot]]\nid = 999\n")
    for name, says in (("none.toml", "cannot be read"), ("bad.toml", "robot.id: got 999")):
        code, _, err = lab(tmp_path / name)
        assert (code, says in err) == (2, True), err
        assert err.count("\n") == 1
    path = write_scenario(tmp_path)
    (tmp_path / "out").write_text("")
    code, _, err = lab(path)
    assert (code, "out cannot be written" in err) == (2, True), err
    assert asked == []


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"pdr": 0.91239, "worst_pdr": 0.5}, "PDR 0.9124 in all, 0.5000 at worst; in lock-step"),
        ({"pace": "realtime"}, "at worst; in real time, took 0 s"),
        ({"out_of_reach": [(1, 3), (3, 1)]}, "excluded from all figures: 1 → 3, 3 → 1"),
        ({"robots": [robot(1, dropped={"tx_expired": 3})]}, "dropped: {'tx_expired': 3}"),
        ({"robots": [robot(1, left=4)]}, "; 4 messages unsent"),
        ({"robots": [robot(1, samples_lost=77)]}, "too slow: 77 samples dropped"),
        ({"robots": [robot(1, bursts_failed=5, bursts_late=6)]}, "30 bursts, 5 failed, 6 late"),
        ({"title": "50 [/b] robots"}, "50 [/b] robots: delivery"),
    ],
)
def test_what_a_run_came_to_is_said(lab, come_to, tmp_path, given, says):
    come_to(report(**given))
    code, out, err = lab(write_scenario(tmp_path))
    assert (code, err) == (0, "")
    assert says in out


def test_a_ledger_that_does_not_add_up_is_a_failure(lab, come_to, tmp_path):
    come_to(report(robots=[robot(1), robot(2, ledger_adds_up=False)]))
    code, out, _ = lab(write_scenario(tmp_path))
    assert code == 1
    (line,) = [each for each in out.splitlines() if "THE LEDGER DOES NOT ADD UP" in each]
    assert line.startswith("robot 2: ")
    assert (tmp_path / "out/report.json").exists()


@pytest.mark.parametrize("name", ["two-robots", "two-robots.toml"])
def test_a_shipped_scenario_is_called_by_its_name(lab, asked, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    code, out, _ = lab(name)
    assert code == 0
    assert asked[0].path == ETC / "scenarios/two-robots.toml"
    assert "starting the hub and 2 robots" in out
    # The user's own setting has priority.
    own = write_scenario(tmp_path).rename(tmp_path / name)
    lab(name)
    assert asked[1].path.absolute() == own


def test_who_mistypes_a_scenario_is_shown_the_names(lab, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, _, err = lab("two-robot")
    assert code == 2
    assert "two-robot: no such scenario; did you mean two-robots?; allowed: a TOML file" in err


def test_scenarios_of_a_wheel_are_found_and_completed(tmp_path, monkeypatch):
    share = tmp_path / "share/sdrlinkd/scenarios"
    share.mkdir(parents=True)
    (share / "mine.toml").write_text("")
    (tmp_path / "more").mkdir()
    (tmp_path / "my-own.toml").write_text("")
    monkeypatch.setattr("sdrlinkd.shipped.IN_TREE", tmp_path / "none")
    monkeypatch.setattr("sdrlinkd.shipped.INSTALLED", share.parent)
    monkeypatch.chdir(tmp_path)
    assert scenario_names("m") == ["mine", "more/", "my-own.toml"]
    assert find_scenario(Path("mine")) == share / "mine.toml"
