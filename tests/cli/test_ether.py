"""`sdrlink-ether`: the hub as a separate program, and daemons that outlive it."""

import gc
import signal
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

from sdrlinkd import __version__
from sdrlinkd.cli.ether import main
from sdrlinkd.client import Publisher, Subscriber
from sdrlinkd.errors import ConfigError, UserError
from sdrlinkd.lab import load_scenario, make_hub
from sdrlinkd.process import Process, module
from tests.backends.hubs import ask
from tests.lab.scenarios import write_scenario
from tests.waiting import wait_for

CDR = b"\0\1\0\0"


@pytest.fixture
def start_hub(tmp_path):
    """Starts hubs of a small scenario in real time; (process, its first line)."""
    with ExitStack() as stack:

        def start(directory, *arguments):
            scenario = write_scenario(tmp_path, pace="realtime")
            command = module("sdrlinkd.cli.ether", scenario, "--dir", directory, *arguments)
            hub = stack.enter_context(Process(command, name="hub"))
            return hub, hub.line()

        yield start


@pytest.fixture
def refused(monkeypatch, capsys):
    """The message of a hub that must not start."""

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["sdrlink-ether", *(str(each) for each in arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        assert ended.value.code == 2
        assert out == ""
        return err

    return call


@pytest.mark.slow
def test_a_hub_tells_where_it_is_and_serves_its_folder_alone(start_hub, refused, tmp_path):
    folder = tmp_path / "air"
    hub, line = start_hub(folder)
    assert line == f"sdrlink-ether {__version__}: Two small robots; sockets in {folder}"
    err = refused("--dir", folder)
    assert f"{folder}: another hub serves this folder; stop it, or name another one" in err
    assert err.count("\n") == 1
    now_s = ask(folder).now_s
    wait_for(lambda: ask(folder).now_s > now_s)
    assert hub.stop() == 0
    assert list(folder.glob("*.sock")) == []
    assert hub.err() == ""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("none.toml",), ["none.toml: cannot be read", "etc/scenarios"]),
        (("bad.toml",), ["bad.toml:2: robot.id: got 999", "from 0 to 254"]),
        (("outage.toml",), ["outages of a.jsonl", "--traces"]),
        (("outage.toml", "--traces", "."), ["a.jsonl: cannot be read", "--traces"]),
        (("--listen", "47900"), ['--listen: got "47900"', "HOST:PORT", "192.168.1.5:47900"]),
        (
            ("--listen", "nowhere.invalid:47900"),
            ["nowhere.invalid:47900", "cannot be opened"],
        ),
        (("--dir", "bad.toml"), ["bad.toml/ether.lock: cannot be opened"]),
        (("--dir", "d" * 120), ["air.sock: the hub's socket cannot be opened"]),
        (("--pace", "fast"), ["--pace", "fast", "realtime", "lockstep"]),
        (("good.toml", "--duration", "0"), ["--duration", "0.001"]),
        (("good.toml", "--seed", "-1"), ["seed"]),
    ],
)
def test_what_a_hub_cannot_serve_it_says(refused, tmp_path, monkeypatch, arguments, parts):
    monkeypatch.chdir(tmp_path)
    robot = "[[robot]]\nid = 1\n"
    (tmp_path / "good.toml").write_text(robot)
    (tmp_path / "bad.toml").write_text(robot.replace("1", "999"))
    (tmp_path / "outage.toml").write_text(robot + '[outages]\ntrace = "a.jsonl"\n')
    where = () if "--dir" in arguments else ("--dir", "air")
    monkeypatch.setattr("sdrlinkd.cli.ether.make_hub", no_hub(make_hub))
    err = refused(*arguments, *where)
    for part in parts:
        assert part in err
    # Everything it opened must be closed: otherwise Python complains now.
    gc.collect()


def no_hub(make):
    """`make`, except that the hub must not run: nobody would stop it."""

    def made(*arguments):
        hub = make(*arguments)
        hub.stop()
        hub.run()
        raise AssertionError("this hub would serve")

    return made


@pytest.fixture
def stopped(monkeypatch, capsys):
    """The message of a hub that is stopped before it begins."""

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["sdrlink-ether", *(str(each) for each in arguments)])
        monkeypatch.setattr(signal, "signal", lambda *_: None)
        monkeypatch.setattr("sdrlinkd.cli.ether.make_hub", stopped_hub)
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        assert not ended.value.code, err
        return out

    return call


def stopped_hub(*arguments):
    hub = make_hub(*arguments)
    hub.stop()
    return hub


@pytest.mark.parametrize(
    ("title", "says"), [('title = "Three"', ": Three; sockets"), ("", ": plain; sockets")]
)
def test_a_hub_is_called_by_its_title_or_else_by_its_file(stopped, tmp_path, title, says):
    (tmp_path / "plain.toml").write_text(f"{title}\n[[robot]]\nid = 1\n")
    assert says in stopped(tmp_path / "plain.toml", "--dir", tmp_path / "air")


def test_options_go_before_the_scenario(refused, monkeypatch, tmp_path):
    scenario = write_scenario(tmp_path, top="seed = 3\n")
    seen = []

    def make(*arguments):
        seen.append(arguments)
        raise UserError("enough")

    monkeypatch.setattr("sdrlinkd.cli.ether.make_hub", make)
    refused(scenario, "--dir", "air")
    refused(scenario, "--seed", 7, "--duration", 9, "--pace", "realtime", "--traces", tmp_path)
    (plain, where, *_), (changed, _, traces, _) = seen
    assert (plain.seed, plain.duration_s, plain.pace) == (3, 1.5, "lockstep")
    assert (changed.seed, changed.duration_s, changed.pace) == (7, 9.0, "realtime")
    assert (where, traces) == (Path("air"), tmp_path)


def test_without_a_scenario_all_hear_all(stopped, tmp_path):
    assert "all robots in range, at 20 dB" in stopped("--dir", tmp_path / "air")


@pytest.mark.parametrize("duration_s", ["0.01", "0.1", "1e5"])
def test_any_duration_of_a_scenario_can_be_told_to_a_hub(stopped, tmp_path, duration_s):
    """A lab passes a scenario's duration this way."""
    path = tmp_path / "s.toml"
    path.write_text(f"duration_s = {duration_s}\n[[robot]]\nid = 1\n")
    try:
        scenario = load_scenario(path)
    except ConfigError:
        return
    stopped(path, "--dir", tmp_path / "air", "--duration", scenario.duration_s)


def on_air(folder, robot):
    """The configuration of a robot on the small scenario's air."""
    return (
        f'namespace = "robot_{robot}"\nbackend = "ether"\n'
        f'[ether]\ndir = "{folder}"\n[modem]\nrate_hz = 1e6\nmcs = 2\n'
    )


def carrier(node):
    return node.snapshot().carrier


def test_why_names_the_missing_hub(start_daemon, ctl, tmp_path_factory):
    node = start_daemon(on_air(tmp_path_factory.mktemp("air"), 1))
    wait_for(lambda: carrier(node).state == "waiting", 60)
    code, out, _ = ctl("why", "cmd_vel", "--runtime-dir", node.directory)
    assert code == 0
    assert out.splitlines()[1].startswith("the link is DOWN: no hub since ")


@pytest.mark.long
def test_daemons_outlive_their_hub(start_hub, start_daemon, tmp_path_factory):
    folder = tmp_path_factory.mktemp("air")
    hub, _ = start_hub(folder)
    nodes = {robot: start_daemon(on_air(folder, robot)) for robot in (1, 2)}
    wait_for(lambda: all(carrier(node).state == "up" for node in nodes.values()), 60)
    with ExitStack() as stack:
        say = {
            robot: stack.enter_context(Publisher(node.directory)) for robot, node in nodes.items()
        }
        heard = {
            robot: stack.enter_context(Subscriber(directory=node.directory))
            for robot, node in nodes.items()
        }

        def talk(word):
            """Send a message from each robot to the other."""
            for robot, other in ((1, 2), (2, 1)):
                say[robot].send(f"/robot_{robot}/cmd_vel", CDR + word)
                message = heard[other].receive(60)
                assert (message.source, message.payload) == (robot, CDR + word)

        talk(b"before")
        before = {robot: carrier(node).counters for robot, node in nodes.items()}
        hub.kill()
        wait_for(lambda: all("hub is gone" in carrier(node).detail for node in nodes.values()), 60)
        for node in nodes.values():
            assert carrier(node).state == "down"
            assert any("the radio delivers no samples" in text for text in carrier(node).notices)
        # What is said while there is no air waits for it.
        say[1].send("/robot_1/cmd_vel", CDR + b"meanwhile")
        wait_for(lambda: nodes[1].snapshot().link.tx.queued == 1)
        # The first one back sends at once: that is robot 2, because otherwise it would not hear
        # what waited.
        nodes[1].send_signal(signal.SIGSTOP)
        start_hub(folder)
        wait_for(lambda: carrier(nodes[2]).state == "up", 60)
        nodes[1].send_signal(signal.SIGCONT)
        wait_for(lambda: all(carrier(node).state == "up" for node in nodes.values()), 60)
        for robot, node in nodes.items():
            counted = carrier(node).counters
            assert counted["hub_outages"] == before[robot]["hub_outages"] + 1
            assert "the hub is gone" not in carrier(node).detail
            assert carrier(node).notices == []
        assert heard[2].receive(60).payload == CDR + b"meanwhile"
        talk(b"after")
    for node in nodes.values():
        with node.control() as control:
            assert control.ask("check")["problems"] == []
