"""`sdrlinkctl init`: its output is valid, and nothing unwanted is written."""

import contextlib
import os
import pty
import subprocess
import sys

import pytest
import zstandard
from rosbags.rosbag2 import StoragePlugin

from sdrlinkd.__main__ import main
from sdrlinkd.cli import run
from sdrlinkd.client import Publisher, Subscriber
from sdrlinkd.config import Config, load_config, load_registry, make_setup, parse_config
from sdrlinkd.init import MOST_TOPICS, RADIOS, FoundTopic, choose, copy_of
from sdrlinkd.process import Process, module, wait_until
from tests.adapters.recordings import noisy_messages, ros2_bag

ODOM = ("--topic", "odom:nav_msgs/msg/Odometry")


@pytest.fixture
def init(tmp_path, capsys):
    """Runs it with `tmp_path`/team as the folder: (exit code, output, errors)."""

    def call(*arguments, out="team"):
        code = run(["init", *map(str, arguments), "--out", str(tmp_path / out)])
        said, err = capsys.readouterr()
        assert "Traceback" not in said + err
        return code, said, err

    return call


def checked(path, capsys):
    """Run `sdrlinkd --check`."""
    code = main(["--check", "--config", str(path)])
    out, err = capsys.readouterr()
    assert (code, err) == (0, ""), err
    assert "warning" not in out
    return out


@pytest.mark.slow
@pytest.mark.parametrize("name", RADIOS)
@pytest.mark.parametrize("robots", [1, 2, 7])
def test_what_it_writes_passes_the_check(init, tmp_path, capsys, name, robots):
    more = ["--frequency", "433.92 MHz"] if RADIOS[name].is_real else []
    if name == "soapy":
        more += ["--device", "driver=airspy"]
    code, said, err = init("--radio", name, "--robots", robots, "--id", "all", *more, *ODOM)
    assert (code, err) == (0, "")
    files = sorted((tmp_path / "team").glob("*.toml"))
    assert len(files) == (robots if RADIOS[name].shares_air else 1)
    for path in files:
        assert f"robot {load_config(path).namespace.removeprefix('robot_')}, " in checked(
            path, capsys
        )
    assert f"sdrlinkd --check --config {files[0]}" in said
    configs = [make_setup(load_config(path), path.parent).config for path in files]
    assert not any(config.soapy.tx_enabled for config in configs)
    assert all(config.access == configs[0].access for config in configs)
    assert configs[0].access.nodes == (list(range(1, robots + 1)) if len(files) > 1 else [])
    if RADIOS[name].is_real:
        assert configs[0].modem.frequency_hz == pytest.approx(433.92e6)
        assert f"doctor --config {files[0]}" in said
        assert "attenuation" in said


def test_one_robot_gets_the_plain_name_and_its_number(init, tmp_path, capsys):
    code, said, _ = init(
        "--radio", "hackrf", "--robots", 2, "--frequency", "433.92 MHz", "--id", 2, *ODOM
    )
    assert code == 0
    assert {path.name for path in (tmp_path / "team").iterdir()} == {
        "sdrlinkd.toml", "registry.csv",
    }  # fmt: skip
    assert "robot 2, namespace robot_2" in checked(tmp_path / "team" / "sdrlinkd.toml", capsys)
    assert "each other robot needs the same registry.csv" in said


def test_nothing_is_replaced_unasked(init, tmp_path):
    ours = ("--radio", "direct", "--id", "1", *ODOM)
    assert init(*ours)[0] == 0
    path = tmp_path / "team" / "sdrlinkd.toml"
    path.write_text("mine")
    code, _, err = init(*ours)
    assert code == 2
    assert "sdrlinkd.toml: already there; allowed: another --out, or --force" in err
    assert path.read_text() == "mine"
    assert init(*ours, "--force")[0] == 0
    assert path.read_text() != "mine"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--radio", "hackrff"), '--radio: got "hackrff"; allowed: hackrf, usrp'),
        (("--radio", "hackrff"), "did you mean hackrf?"),
        ((), "--radio: not given, and no terminal to ask on; which radio? such as hackrf"),
        (("--radio", "usrp"), "--robots: not given"),
        (("--radio", "usrp", "--robots", "2"), "--frequency: not given"),
        (("--radio", "usrp", "--robots", "2", "--frequency", "433"), "with its unit"),
        (("--radio", "usrp", "--robots", "2", "--frequency", "5 GB"), "--frequency: got 5 GB"),
        (("--radio", "ether", "--robots", "2"), "--id: not given"),
        (("--radio", "direct", "--id", "1", *ODOM, "--hub", "a:1"), "allowed with --radio ether"),
        (
            ("--radio", "ether", "--robots", "1", *ODOM, "--hub", "a"),
            '--hub: got "a"; allowed: HOST:PORT',
        ),
        (("--radio", "direct", "--id", "2"), '--id: got "2"; allowed: 1 to 1, or all'),
        (("--radio", "direct", "--id", "1"), "--topic: not given"),
        (("--radio", "direct", "--id", "1", "--topic", "odom"), "allowed: NAME:TYPE"),
        (("--radio", "direct", "--id", "1", "--topic", "o:dom"), "package/msg/Name"),
        (("--radio", "direct", "--id", "1", *ODOM, *ODOM), "listed twice"),
        (("--radio", "direct", "--id", "1", "--bag", "none"), "no such file"),
        (("--radio", "direct", "--id", "1", "--bag", "none", "--from-graph"), "one of them"),
        (
            ("--radio", "soapy", "--robots", "1", "--frequency", "1GHz", "--device", "uhd"),
            "allowed: KEY=VALUE",
        ),
        (
            ("--radio", "direct", "--id", "1", *(f"--topic=t{i}:a/B" for i in range(16))),
            "16 topics; allowed: at most 15",
        ),
    ],
)
def test_what_is_wrong_is_told_and_nothing_written(init, tmp_path, arguments, says):
    code, said, err = init(*arguments)
    assert (code, said, err.count("\n")) == (2, "", 1)
    assert says in err
    assert not (tmp_path / "team").exists()


def test_of_a_large_bag_the_small_and_busy_topics_stay(init, tmp_path, capsys):
    topics = {f"/robot_1/t{i:02}": ("std_msgs/msg/String", i + 1) for i in range(16)}
    topics |= {
        "/robot_1/image": ("sensor_msgs/msg/Image", 99),
        "/rosout": ("rcl_interfaces/msg/Log", 99),
    }
    found = [FoundTopic(name, kind, n) for name, (kind, n) in topics.items()]
    choice = choose(found, [], "a bag")
    assert len(choice.taken) == MOST_TOPICS
    assert [each.name for each in choice.taken] == [f"t{i:02}" for i in range(15, 0, -1)]
    assert set(choice.left_out) == {"t00", "image", "rosout"}
    assert "small types before large ones" in choice.left_out["image"]
    assert choice.left_out["rosout"] == "ROS internal"
    wanted = choose(found, ["/robot_1/image", "t00"], "a bag")
    assert [each.name for each in wanted.taken] == ["image", "t00"]
    assert wanted.left_out["t01"] == "not requested"


def test_robots_of_one_team_share_a_line():
    kinds = ["a/msg/B", "a/msg/B", "a/msg/C"]
    found = [FoundTopic(f"/robot_{i}/odom", kind, 5) for i, kind in enumerate(kinds)]
    choice = choose(found, [], "a bag")
    assert choice.taken == [FoundTopic("odom", "a/msg/B", 10)]
    assert choice.left_out == {"/robot_2/odom": "type a/msg/C, but another robot's is a/msg/B"}


def test_a_bag_makes_the_registry(init, tmp_path, capsys):
    bag = ros2_bag(tmp_path / "bag", StoragePlugin.MCAP, noisy_messages(1, 9))
    code, _, err = init("--radio", "direct", "--id", "1", "--bag", bag)
    assert code == 0, err
    registry = load_registry(tmp_path / "team" / "registry.csv")
    assert [each.name for each in registry.topics] == ["odom", "chat"], "the busiest first"
    code, _, err = init(
        "--radio", "direct", "--id", "1", "--bag", bag, "--topic", "none", out="again"
    )
    assert (code, '--topic: got "none"; allowed: ' in err) == (2, True)


def test_the_graph_is_asked_of_ros_itself(init, tmp_path, monkeypatch):
    ros2 = tmp_path / "bin" / "ros2"
    ros2.parent.mkdir()
    ros2.write_text(
        '#!/bin/sh\n[ "$*" = "topic list -t" ] || exit 9\n'
        "echo '/parameter_events [rcl_interfaces/msg/ParameterEvent]'\n"
        "echo '/odom [nav_msgs/msg/Odometry]'\necho '/two [a/msg/B, c/msg/D]'\n"
    )
    ros2.chmod(0o755)
    ours = ("--radio", "direct", "--id", "1", "--from-graph")
    monkeypatch.setenv("PATH", "/nonexistent")
    code, _, err = init(*ours)
    assert (code, "source ROS 2's setup.bash" in err) == (2, True)
    monkeypatch.setenv("PATH", f"{ros2.parent}:/usr/bin:/bin")
    code, _, err = init(*ours)
    assert (code, "left out: parameter_events (ROS internal)" in err) == (0, True)
    registry = load_registry(tmp_path / "team" / "registry.csv")
    assert [(each.name, each.type) for each in registry.topics] == [
        ("odom", "nav_msgs/msg/Odometry")
    ]
    ros2.write_text("#!/bin/sh\necho no daemon >&2\nexit 1\n")
    code, _, err = init(*ours, "--force")
    assert (code, "failed: no daemon" in err) == (2, True)


def test_a_running_daemon_lends_its_configuration(start_daemon, init, tmp_path, capsys):
    daemon = start_daemon(
        'drain_s = 2.0\n[topic.odom]\ndepth = 1\nlifespan_s = "300 ms"\n[link]\npdu_size = 512\n'
    )
    given = ("--from-daemon", "--runtime-dir", daemon.directory)
    code, _, err = init(*given, "--id", "7")
    assert code == 0, err
    path = tmp_path / "team" / "sdrlinkd.toml"
    theirs, ours = (make_setup(load_config(each), each.parent) for each in (daemon.config, path))
    assert (ours.node_id, ours.config.namespace) == (7, "robot_7")
    assert ours.policies == theirs.policies
    assert ours.registry.digest() == theirs.registry.digest()
    assert (ours.config.link, ours.config.drain_s) == (theirs.config.link, 2.0)
    assert ours.config.bus.runtime_dir == ""
    code, _, err = init(*given, "--id", "all", "--force")
    assert (code, "allowed with --from-daemon: one robot" in err) == (2, True)


@pytest.mark.parametrize(
    ("namespace", "robot_id", "expected"),
    [
        ("robot_3", -1, ("robot_7", -1)),
        ("robot_3", 3, ("robot_7", 7)),
        ("site7/husky", 3, ("site7/husky", 7)),
        ("site7/husky_03", 3, ("site7/husky_7", 7)),
        ("site3/husky_7", 3, ("site3/husky_7", 7)),
        ("", -1, ("", 7)),
        ("", 3, ("", 7)),
    ],
)
def test_only_the_robots_own_number_changes(namespace, robot_id, expected):
    config = Config(namespace=namespace, robot_id=robot_id)
    copy = parse_config(copy_of(config, 3, 7))
    assert (copy.namespace, copy.robot_id) == expected


def test_a_copy_brings_dictionaries_and_whole_paths(start_daemon, init, tmp_path):
    samples = [f"{i:05} odometry {i * 7919 % 1000}".encode() * 5 for i in range(500)]
    trained = zstandard.train_dictionary(1000, samples).as_bytes()
    theirs = tmp_path / "odom.dict"
    theirs.write_bytes(trained)
    daemon = start_daemon(f'[topic.odom]\ndictionary = "{theirs}"\n[play]\nbag = "ride"\n')
    given = ("--from-daemon", "--runtime-dir", daemon.directory, "--id", "7")
    code, _, err = init(*given)
    assert code == 0, err
    assert (tmp_path / "team" / "odom.dict").read_bytes() == trained
    copy = load_config(tmp_path / "team" / "sdrlinkd.toml")
    assert copy.topic["odom"].dictionary == "odom.dict"
    assert copy.play.bag == str(daemon.config.parent / "ride")
    theirs.unlink()
    code, _, err = init(*given, out="again")
    assert (code, "topic.odom.dictionary" in err, str(theirs) in err) == (2, True, True)
    assert not (tmp_path / "again").exists()


def test_what_a_person_gives_is_quoted(init, tmp_path):
    out = 'say "hi" \\ there'
    code, _, err = init("--radio", "ether", "--robots", 2, "--id", "all", *ODOM, out=out)
    assert code == 0, err
    written = load_config(tmp_path / out / "robot_2.toml")
    assert written.ether.dir == str(tmp_path / out / "air")
    device = 'driver=uhd,serial="3"'
    real = ("--radio", "usrp", "--robots", 1, "--frequency", "1 GHz", *ODOM)
    assert init(*real, "--device", device, out="real")[0] == 0
    assert load_config(tmp_path / "real" / "sdrlinkd.toml").soapy.device == device


def test_robots_on_computers_of_their_own_share_a_hub(init, tmp_path):
    hub = "192.168.1.5:47900"
    given = ("--radio", "ether", "--robots", 2, "--id", "all", *ODOM, "--hub", hub)
    code, said, err = init(*given)
    assert code == 0, err
    for number in (1, 2):
        written = load_config(tmp_path / "team" / f"robot_{number}.toml")
        assert (written.ether.hub, written.ether.dir, written.bus.runtime_dir) == (hub, "", "")
    assert "sdrlink-ether --listen 0.0.0.0:47900 &" in said
    assert "copy registry.csv and robot_2.toml to the other robot" in said


def test_all_files_or_none(init, tmp_path):
    (tmp_path / "team" / "sdrlinkd.toml").mkdir(parents=True)
    code, _, err = init("--radio", "direct", "--id", "1", *ODOM, "--force")
    assert (code, "sdrlinkd.toml cannot be written (it is a directory)" in err) == (2, True)
    assert [each.name for each in (tmp_path / "team").iterdir()] == ["sdrlinkd.toml"]


@pytest.mark.slow
def test_what_is_missing_is_asked_with_a_default(tmp_path, capsys):
    """On a terminal: a wrong answer is asked again, an empty one means the default."""
    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "sdrlinkd.cli", "init", "--out", str(tmp_path / "team")],
        stdin=theirs, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    os.write(ours, b"hackrff\n\n\n\n2\nodom:nav_msgs/msg/Odometry imu:sensor_msgs/msg/Imu\nn\n")
    said, _ = process.communicate(timeout=60)
    os.close(ours)
    os.close(theirs)
    assert process.returncode == 0, said
    for part in (
        'got "hackrff"; allowed', "how many robots share the channel [2]",
        "which frequency (one that your antenna and licence cover) [433.92 MHz]",
        "which robot is this, 1 to 2, or all [1]", "HackRF One (half duplex",
        "seal the link, so that only your team can send and read [Y/n]",
    ):  # fmt: skip
        assert part in said
    assert "robot 2" in checked(tmp_path / "team" / "sdrlinkd.toml", capsys)
    assert len(load_registry(tmp_path / "team" / "registry.csv")) == 2


@pytest.mark.slow
def test_a_team_on_the_ether_talks_at_once(init, tmp_path, monkeypatch):
    """As on the ether's page: a hub, and the daemons with what was written."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert init("--radio", "ether", "--robots", 2, "--id", "all", *ODOM)[0] == 0
    lines = [
        ("sdrlinkd.cli.ether", "--dir", "team/air"),
        ("sdrlinkd", "--config", "team/robot_1.toml"),
        ("sdrlinkd", "--config", "team/robot_2.toml"),
    ]
    with contextlib.ExitStack() as stack:
        team = [stack.enter_context(Process(module(*line))) for line in lines]
        sockets = [tmp_path / "sdrlinkd" / f"robot_{number}" for number in (1, 2)]
        for each in sockets:
            wait_until((each / "out.sock").exists, 60, *team)
        with (
            Publisher(sockets[0]) as out,
            Subscriber("/rx_robot_1/odom", directory=sockets[1]) as heard,
        ):

            def is_heard():
                out.send("/robot_1/odom", bytes(700))
                return heard.receive(0.1)

            wait_until(is_heard, 60, *team)


def test_a_sealed_team_gets_a_key(init, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    code, said, err = init("--radio", "ether", "--robots", 2, "--id", "all", "--seal", *ODOM)
    assert (code, err) == (0, "")
    keys, config = tmp_path / "team" / "keys.toml", tmp_path / "team" / "robot_1.toml"
    assert keys.stat().st_mode & 0o777 == 0o600
    assert f"sdrlinkctl key install --new --config {config}" in said
    assert run(["key", "install", "--new", "--config", str(config)]) == 0
    assert "installed: key 0, made " in capsys.readouterr().out
    assert "PDUs are sealed: only the team's key sends" in checked(config, capsys)


def test_a_real_radio_is_told_to_carry_the_key_along(init, tmp_path, capsys):
    code, said, _ = init(
        "--radio", "hackrf", "--robots", 2, "--id", 1, "--frequency", "433.92 MHz", "--seal", *ODOM
    )
    assert code == 0
    assert "each other robot needs the same registry.csv and keys.toml (secret)" in said
