"""Common mistakes in a configuration: each yields one line that says where and what."""

import os
import re
import socket
import subprocess
import sys
from pathlib import Path

import pytest
import zmq
from msgspec import inspect

from sdrlinkd.__main__ import main
from sdrlinkd.bus import RuntimeDirectory
from sdrlinkd.client import CONTROL_SOCKET
from sdrlinkd.config import Config

ETC = Path(__file__).parents[2] / "etc"

LOOPBACK = 'backend = "loopback"\n'
SOAPY = 'backend = "soapy"\n[soapy]\ndevice = "driver=uhd"\n'
UDP = 'backend = "gnuradio"\n[gnuradio]\ntransport = "udp"\n'
ON_AIR = "[modem]\nfrequency_hz = 4e8\n"


def test_every_whole_number_has_a_largest_and_a_smallest_value():
    """Beyond them, it is said so; no number of the system's is the limit."""
    seen, found = set(), []

    def walk(kind, name):
        if isinstance(kind, inspect.StructType):
            if kind.cls not in seen:
                seen.add(kind.cls)
                for each in kind.fields:
                    walk(each.type, f"{kind.cls.__name__}.{each.name}")
        elif isinstance(kind, inspect.IntType):
            found.append(name)
            assert None not in (kind.ge, kind.le), name
        else:
            for part in ("types", "type", "item_type", "key_type", "value_type", "item_types"):
                inner = getattr(kind, part, ())
                for each in inner if isinstance(inner, tuple) else (inner,):
                    if isinstance(each, inspect.Type):
                        walk(each, name)

    walk(inspect.type_info(Config), "")
    assert {"Config.seed", "Config.rx_depth", "TopicPolicy.depth"} <= set(found)


# Content of the file, the cited line (0: none), and the message.
MISTAKES = [
    ('namespce = "robot_1"', 1, ["namespce: unknown key; did you mean namespace?"]),
    ('[topic.scan]\nqos = "realtime"', 2, ['topic.scan.qos: got "realtime"', 'one of "bulk"']),
    ("[link]\npdu_size = 3000", 2, ["link.pdu_size: got 3000", "from 32 to 2047"]),
    ('[link]\npdu_size = "1024"', 2, ['link.pdu_size: got "1024"', "a whole number"]),
    ("[link]\nhop_limit = 0", 2, ["link.hop_limit: got 0", "from 1 to 15"]),
    ("[link]\n\nbeacon_s = 1e-9", 3, ["link.beacon_s", "at least 0.01"]),
    ("[link]\nmin_fragment = 2000", 2, ["link.min_fragment: got 2000", "at most 1011"]),
    ("robot_id = 300", 1, ["robot_id: got 300", "from -1 to 254"]),
    ('namespace = "robot"', 1, ["robot_id", 'in "robot" it is missing', "robot_1"]),
    ('namespace = "a b1"', 1, ['namespace: got "a b1"', "a ROS namespace"]),
    ('rx_format = "heard"', 1, ['rx_format: got "heard"', "{src_id}"]),
    ('registry = "nowhere.csv"', 0, ["registry is unreadable"]),
    ("registry = 5", 1, ["registry: got 5", "text"]),
    ('topics = ["odm"]', 1, ['topics: got "odm"', "did you mean odom"]),
    ('topics = "odom"', 1, ['topics: got "odom"', "a list"]),
    ("[topic.odo]\ndepth = 1", 1, ['topic."odo": unknown topic', "did you mean odom"]),
    ('[topic.odom]\n[topic."/odom"]', 2, ["listed twice"]),
    ("[topic.odom]\ndepth = 9223372036854775807", 2, ["got 9223372036854775807", "to 1000000"]),
    ("[topic.odom]\nprio = 3", 2, ["topic.odom.prio: unknown key; did you mean priority"]),
    ('[topic.odom]\nlifespan_s = "0.3 parsec"', 2, ["topic.odom.lifespan_s", '"300 ms"']),
    ('[topic.odom]\nlifespan_s = "soon"', 2, ['got "soon"', "with a unit"]),
    ("[topic.odom]\nreserve = true", 2, ["topic.odom.reserve", "period_s and max_bytes"]),
    (
        "[admission]\nshare = 0\n[topic.odom]\nreserve = true\nperiod_s = 1\nmax_bytes = 9", 4,
        ["topic.odom.reserve", "admission.share above 0"],
    ),
    ("[admission]\nshare = 1.1", 2, ["admission.share: got 1.1", "from 0 to 1"]),
    ("[topic.odom]\ndepth = -1", 2, ["topic.odom.depth: got -1"]),
    (
        '[topic.odom]\ncompress = "zstd"\ndictionary = "none.zdict"', 3,
        ["topic.odom.dictionary", "train-dict"],
    ),
    ("[topic.cmd_vel]\nstop = { linear = { q = 1 } }", 2, ["cmd_vel.stop.linear.q", "x, y, z"]),
    ('[tf]\ntopics = ["odom"]', 2, ['tf.topics: got "odom"', "TFMessage: none"]),
    ('backend = "usrp"', 1, ['backend: got "usrp"', '"soapy"']),
    ('[access]\npolicy = "csma"', 2, ['access.policy: got "csma"', '"direct" has no channel']),
    ('[access]\npolicy = "tdma"\nnodes = [1, 2]', 2, ["access.policy", '"direct" has no channel']),
    (f'{LOOPBACK}[access]\npolicy = "aloha"', 3, ['access.policy: got "aloha"', '"minislot"']),
    (f'{LOOPBACK}[access]\npolicy = "tdma"\nnodes = [2, 3]', 4, ["access.nodes: got [2, 3]"]),
    (f'{LOOPBACK}[access]\npolicy = "tdma"', 3, ["access.nodes: got []", "this robot's 1"]),
    (
        f'{LOOPBACK}[access]\nnodes = [1, 2, 1]\npolicy = "minislot"', 3,
        ["access.nodes", "each robot once"],
    ),
    ("[rate]\nmin_mcs = 3\nmax_mcs = 2", 2, ["rate.min_mcs: got 3", "rate.max_mcs, 2"]),
    ("[link]\nbeacon_s = 0\n[rate]\nadapt = true", 4, ["rate.adapt: got true", "beacons"]),
    ('[relay]\npolicy = "routes"', 2, ["relay.routes: got []", "1>3"]),
    ('[relay]\npolicy = "routes"\nroutes = ["1-3"]', 3, ['relay.routes: got "1-3"', "FROM>TO"]),
    ('[relay]\npolicy = "flood"', 2, ["link.hop_limit: got 1", "at least 2"]),
    ('[relay]\npolicy = "auto"', 2, ["link.hop_limit: got 1", "at least 2"]),
    ('[chrony]\nsocket = "/run/c.sock"\nrobot = 1', 3, ["chrony.robot: got 1", "another robot"]),
    (
        f"{LOOPBACK}[modem]\nrate_hz = 1e5\nmax_cfo_hz = 1e5", 4,
        ["modem.max_cfo_hz: got 100000", "25000"],
    ),
    (
        f"{LOOPBACK}[modem]\nrate_hz = 1e4\nmax_cfo_hz = 1e3", 3,
        ["modem.rate_hz: got 10000", "on the air", "reassembly.timeout_s"],
    ),
    (f'{LOOPBACK}[modem]\nfrequency_hz = "433 Mhm"', 3, ['"433 Mhm"', '"433.92 MHz"']),
    (f'{LOOPBACK}[modem]\nrate_hz = "5 kHz"', 3, ['modem.rate_hz: got "5 kHz"', '"2 Msps"']),
    ("[modem]\nmcs = 10", 2, ["modem.mcs: got 10", "from 0 to 9"]),
    ('backend = "ether"', 1, ['ether.dir: got ""', "sdrlink-ether --dir"]),
    ('backend = "iqfile"', 1, ["iqfile.receive, iqfile.transmit", "name a recording"]),
    ('backend = "zmq"\n[zmq]\nsend = "tcp://127.0.0.1:1"', 1, ['zmq.receive: got ""']),
    ('backend = "soapy"', 1, ['soapy.device: got ""', "radio probe"]),
    ('backend = "soapy"\n[soapy]\ndevice = "hackrf"', 3, ['got "hackrf"', "driver=hackrf"]),
    (SOAPY, 1, ["modem.frequency_hz: got 0 (not set)", "licence"]),
    (f"{SOAPY}tx_enabled = true\n{ON_AIR}", 4, ["soapy.tx_gain_db: not set", "start low"]),
    (f'{SOAPY}offset_tuning = "on"\n{ON_AIR}', 4, ['soapy.offset_tuning: got "on"']),
    (
        f"{SOAPY.replace('uhd', 'hackrf')}{ON_AIR}rate_hz = 1e6", 6,
        ["modem.rate_hz: got 1 Msps", "at least 2 Msps"],
    ),
    ("[direct]\nloss = 1.5", 2, ["direct.loss: got 1.5", "from 0 to 1"]),
    ("drain_s = true", 1, ["drain_s: got true", "a number"]),
    ("[[link]]\npdu_size = 64", 1, ["link: got", "a table"]),
    ("nonsense", 1, ["not TOML"]),
    ("seed = 1\nnamespace = robot_1", 2, ["not TOML: Invalid value, column 13", "in quotes"]),
    ("namespace = \u201crobot_1\u201d", 1, ["not TOML", "\u201c is a typographic quote"]),
    ("namespace: robot_1", 1, ["not TOML", "looks like YAML; write namespace = …"]),
    ('{"namespace": "robot_1"}', 1, ["not TOML", "looks like JSON"]),
    ("a = " + "[" * 3000, 0, ["not TOML"]),
    (f"{SOAPY}[modem]\nfrequency_hz = 433.92", 5, ["got 433.92 Hz", 'write "433.92 MHz"?']),
    ('backend = "ether"\n[ether]\nhub = "tcp://192.168.1.5:47900"', 3, ["HOST:PORT"]),
    ('backend = "ether"\n[ether]\nhub = "192.168.1.5"', 3, ["HOST:PORT"]),
    # What is tried besides, as a check that has passed means that the daemon starts.
    (f'{LOOPBACK}[security]\nmode = "seal"\nkeys = "none.toml"', 4, ["none.toml"]),
    ('[bus]\nruntime_dir = "/dev/null"', 2, ["/dev/null is not a directory"]),
    ('backend = "iqfile"\n[iqfile]\nreceive = "none.sigmf-meta"', 3, ["no such recording"]),
    ('[play]\nduration_s = 5\nbag = "none.mcap"', 3, ["none.mcap"]),
    ('registry = "a\\u0000b"', 0, ["registry is unreadable"]),
    ('[bus]\nruntime_dir = "a\\u0000b"', 2, ["bus.runtime_dir", "NUL"]),
]  # fmt: skip


@pytest.fixture
def check(tmp_path, capsys):
    """`sdrlinkd --check` of a text: exit code, output, and errors."""

    def of(text):
        path = tmp_path / "m.toml"
        path.write_text(text)
        code = main(["--check", "--config", str(path)])
        out, err = capsys.readouterr()
        return code, out, err.replace(f"{tmp_path}/", "")

    (tmp_path / "registry.csv").write_text((ETC / "registry.csv").read_text())
    return of


@pytest.mark.parametrize(("text", "line", "parts"), MISTAKES)
def test_a_mistake_is_told_in_one_line_with_its_place(check, text, line, parts):
    code, out, err = check(text)
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert "Traceback" not in err
    cited = re.match(r"sdrlinkd: m\.toml:(\d+): ", err)
    assert int(cited[1]) == line if line else not cited, err
    for part in parts:
        assert part in err


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ('[security]\nmode = "seal"\nkeys = "none.toml"', "none.toml"),
        ('[bus]\nruntime_dir = "/dev/null"', "/dev/null"),
        ('[play]\nduration_s = 5\nbag = "none.mcap"', "none.mcap"),
        (f'{UDP}send = "127.0.0.1:9"\nreceive = "127.0.0.1:{{taken}}"', "another program uses"),
    ],
)
def test_what_the_check_refuses_does_not_start_either(check, tmp_path, text, part):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        code, _, err = check(text.replace("{taken}", str(taken.getsockname()[1])))
        assert (code, part in err) == (2, True), err
        started = subprocess.run(
            [sys.executable, "-m", "sdrlinkd", "--config", str(tmp_path / "m.toml")],
            env=os.environ | {"SDRLINKD_RUNTIME_DIR": str(tmp_path / "run")},
            capture_output=True, text=True, check=False, timeout=60,
        )  # fmt: skip
    assert (started.returncode, part in started.stderr) == (2, True), started.stderr


def test_a_check_beside_a_running_daemon_passes_and_leaves_no_trace(check, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    directory = tmp_path / "run"
    text = f'[bus]\nruntime_dir = "{directory}"'
    assert check(text)[0] == 0
    assert not directory.exists()
    running, context = RuntimeDirectory(directory), zmq.Context()
    bound = running.bind(context, zmq.ROUTER, CONTROL_SOCKET, {})
    code, out, _ = check(text)
    bound.close()
    context.term()
    running.close()
    assert code == 0
    assert f"a daemon runs in {directory}, process {os.getpid()}" in out


@pytest.mark.parametrize(
    ("text", "warning"),
    [
        ('namespace = "robot_01"', "write robot_1"),
        ('[topic.cmd_vel]\nqos = "urgent"\nlifespan_s = 300', 'write "300 ms"'),
        ("", "odometer: the type nav_msgs/msg/Odometri is unknown; did you mean nav_msgs/msg/Odom"),
    ],
)
def test_what_is_allowed_but_hardly_meant_is_warned_of(check, tmp_path, text, warning):
    with (tmp_path / "registry.csv").open("a") as file:
        file.write("odometer,nav_msgs/msg/Odometri\nmine,my_robot/msg/State\n")
    code, out, _ = check(text)
    assert code == 0
    warnings = [line for line in out.splitlines() if line.startswith("warning: ")]
    assert any(warning in line for line in warnings), out
    assert not any("my_robot" in line for line in warnings)


def test_there_are_forty_and_more():
    assert len(MISTAKES) >= 40


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (
            f'{SOAPY}rx_gains = {{ VGA = 90 }}\n{ON_AIR}[access]\npolicy = "tdma"\nnodes = [1, 2]',
            ["not checked: whether", "frequency, rate, gains", "doctor", '"tdma" fits'],
        ),
        ('backend = "ether"\n[ether]\ndir = "air"', ["not checked: whether a hub answers"]),
        (
            'backend = "iqfile"\n[iqfile]\nreceive = "registry.csv"',
            ["not checked: whether", "is readable"],
        ),
        ('backend = "zmq"\n[zmq]\nsend = "@a"\nreceive = "b"', ["not checked: whether the flowg"]),
        (
            'backend = "gnuradio"\n[gnuradio]\ntransport = "udp"\nsend = "127.0.0.1:9"',
            ["flowgraph answers"],
        ),
    ],
)
def test_what_only_the_radio_can_tell_is_named(check, text, parts):
    code, out, err = check(text)
    assert (code, err) == (0, "")
    for part in parts:
        assert part in out
    assert "the configuration is valid" not in out
    assert out.endswith("the file is valid; the daemon checks the rest when it starts\n")


@pytest.mark.parametrize("text", ["", LOOPBACK, 'backend = "iqfile"\n[iqfile]\ntransmit = "x"'])
def test_what_the_file_alone_decides_is_good(check, text):
    code, out, _ = check(text)
    assert (code, out.endswith("the configuration is valid\n")) == (0, True)


def test_large_fragments_that_keep_topics_apart_are_warned_of(check):
    _, out, _ = check("[link]\nmin_fragment = 504")
    assert "warning: link.min_fragment = 504 is more than the 503 B that each of two topics" in out
    assert "min_fragment" not in check("[link]\nmin_fragment = 503")[1]


def test_a_registry_beyond_the_limit_says_what_to_do(check, tmp_path):
    for n, parts in (
        (23, ["23 topics; allowed: at most 15", "remove 8 lines", "all robots"]),
        (17, ["17 topics; allowed: at most 15", "remove 2 lines"]),
    ):
        (tmp_path / "many.csv").write_text("".join(f"t{i},a/B\n" for i in range(n)))
        code, _, err = check('registry = "many.csv"')
        assert (code, err.count("\n")) == (2, 1)
        for part in parts:
            assert part in err
    (tmp_path / "many.csv").write_text("".join(f"t{i},a/B\n" for i in range(16)))
    code, out, _ = check('registry = "many.csv"')
    assert code == 0
    assert "warning: 16 topics use every topic id: no ages" in out


@pytest.mark.parametrize("path", [".", "none.toml"])
def test_a_file_that_cannot_be_read_is_told(capsys, path):
    assert main(["--check", "--config", path]) == 2
    err = capsys.readouterr().err
    assert (err.count("\n"), "Traceback" in err) == (1, False)
