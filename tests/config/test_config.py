"""The configuration: the shipped file has the defaults; errors cite key, given, allowed."""

from pathlib import Path

import msgspec
import pytest

from sdrlinkd.config import (
    TF_TYPE,
    Config,
    load_config,
    make_setup,
    parse_config,
    policies_by_type,
)
from sdrlinkd.errors import ConfigError, RegistryError, UserError
from sdrlinkd.link import ClassParams, TopicPolicy
from sdrlinkd.wire import topic_type

ROOT = Path(__file__).parents[2]
ETC = ROOT / "etc"

SOAPY = 'backend = "soapy"\n[soapy]\ndevice = "driver=hackrf"\n'


def test_shipped_file_equals_the_defaults():
    assert load_config(ETC / "sdrlinkd.toml") == Config()


def test_shipped_file_shows_every_key():
    text = (ETC / "sdrlinkd.toml").read_text()
    sections = [
        type(value)
        for value in msgspec.structs.asdict(Config()).values()
        if isinstance(value, msgspec.Struct)
    ]
    for struct in (Config, *sections, ClassParams, TopicPolicy):
        for key in struct.__struct_encode_fields__:
            shown = (f"\n{key} = ", f"\n# {key} = ", f"[{key}", f".{key}]")
            assert any(each in text for each in shown), key


def test_shipped_registry_is_the_papers_table_4():
    setup = make_setup(Config(), ETC)
    assert [(t.name, t.type) for t in setup.registry.topics] == [
        ("scan", "sensor_msgs/msg/LaserScan"),
        ("odom", "nav_msgs/msg/Odometry"),
        ("imu", "sensor_msgs/msg/Imu"),
        ("cmd_vel", "geometry_msgs/msg/Twist"),
        ("map", "nav_msgs/msg/OccupancyGrid"),
        ("clock", "rosgraph_msgs/msg/Clock"),
    ]


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ('[link]\npdu_size = "64"', ["f.toml:2", "link.pdu_size", '"64"', "from 32 to 2047"]),
        ("[link]\npdu_size = 3000", ["link.pdu_size", "3000", "from 32 to 2047"]),
        ("[link]\npdu_sise = 64", ["f.toml:2", "link.pdu_sise", "did you mean pdu_size"]),
        ("robot_id = 300", ["f.toml:1", "robot_id", "300", "from -1 to 254"]),
        ("topics = [1]", ["topics", "got 1", "text"]),
        ("link = 3", ["link", "got 3", "a table"]),
        ("[link]\nflush_s = nan", ["link.flush_s", "nan"]),
        ('[link]\nflush_s = "soon"', ['link.flush_s: got "soon"', '"now" or a number at least 0']),
        ("[link]\nflush_s = -1", ["link.flush_s: got -1", '"now" or a number at least 0']),
        ("[link]\nflush_s = true", ["link.flush_s: got true", '"now" or a number at least 0']),
        ("[link]\ngreedy = 1", ["link.greedy", "got 1", "true or false"]),
        ('backend = "usrp"', ["backend", '"usrp"', 'one of "direct", "ether"', '"soapy"']),
        ("[modem]\nmcs = 10", ["f.toml:2", "modem.mcs", "got 10", "from 0 to 9"]),
        ("[modem]\nrate_hz = 0", ["modem.rate_hz", "got 0"]),
        ('backend = "iqfile"', ["iqfile.receive, iqfile.transmit", "name a recording"]),
        ('backend = "soapy"', ['soapy.device: got ""', "driver=hackrf", "radio probe"]),
        (f"{SOAPY}", ["modem.frequency_hz: got 0 (not set)", "licence"]),
        (f"{SOAPY}tx_enabled = true\n[modem]\nfrequency_hz = 4e8", ["soapy.tx_gain_db: not set"]),
        (
            f'{SOAPY}offset_tuning = "on"\n[modem]\nfrequency_hz = 4e8',
            ['soapy.offset_tuning: got "on"', "modem.oversampling = 2 or 4"],
        ),
        (f"{SOAPY}tx_gain_db = 'much'", ["f.toml:4", "soapy.tx_gain_db", "a number"]),
        ('backend = "zmq"\n[zmq]\nreceive = "ipc:///x"', ['zmq.send: got ""', "tcp://127.0.0.1"]),
        ('backend = "zmq"\n[zmq]\npattern = "pull"', ["zmq.pattern", '"push"', '"req"']),
        ('backend = "gnuradio"\n[gnuradio]\nsend = "ipc:///x"', ['gnuradio.receive: got ""']),
        ('backend = "gnuradio"\n[gnuradio]\ntransport = "tcp"', ['gnuradio.send: got ""']),
        (
            'backend = "gnuradio"\n[gnuradio]\nsend = "x"\nreceive = "y"\n[access]\npolicy="csma"',
            ["access.policy", "gnuradio", "no channel to sense"],
        ),
        (
            'backend = "loopback"\n[modem]\nrate_hz = 1e5\nmax_cfo_hz = 1e5',
            ["modem.max_cfo_hz", "got 100000", "25000", '"auto"'],
        ),
        (
            "[modem]\nmax_cfo_hz = true",
            ["f.toml:2: modem.max_cfo_hz: got true", '"auto" or a number from 0 to 1000000'],
        ),
        ('[iqfile]\nformat = "cu8"', ["iqfile.format", '"cu8"', '"ci16_le"']),
        ('[channel]\nprofile = "x"', ["channel.profile", '"awgn"']),
        ('[[channel.jammer]]\nkind = "x"', ["channel.jammer", '"tone"']),
        ("nonsense", ["not TOML"]),
        ('[topic.odom]\nqos = "hi"', ["f.toml:2", "topic.odom.qos", '"hi"', '"urgent"']),
        ("[topic.odom]\nprio = 3", ["topic.odom.prio", "did you mean priority"]),
        (
            "[topic.a]\npriority = 4\n[topic.odom]\npriority = 400",
            ["f.toml:4", "topic.odom.priority", "400", "127"],
        ),
        ("[topic]\nodom = 3", ["topic.odom", "got 3", "a table"]),
        ("[topic.odo]\n", ["odo", "did you mean odom"]),
        ('topics = ["od"]', ["topics", '"od"', "did you mean odom"]),
        ('namespace = "robot"', ["robot_id", "-1", "robot_1"]),
        ('namespace = "a b1"', ["namespace", '"a b1"']),
        ('rx_format = "x"', ["rx_format", '"x"', "{src_id}"]),
        ("[link]\nmin_fragment = 2000", ["link.min_fragment", "2000", "1011"]),
        ('registry = "a\\u0000b"', ["registry is unreadable"]),
        ("seed = " + "9" * 5000, ["not TOML"]),
        ("a = " + "[" * 3000, ["not TOML"]),
        ('namespace = "robot_' + "1" * 5000 + '"', ["robot_id"]),
        ('[bus]\nruntime_dir = "a\\u0000b"', ["bus.runtime_dir", "NUL"]),
        ('rx_format = "/x y{src_id}"', ["rx_format"]),
        ('[topic.odom]\n[topic."/odom"]', ["listed twice"]),
        ("[link]\nbeacon_s = 1e-9", ["link.beacon_s", "at least 0.01"]),
        ("[direct]\nloss = 1.5", ["direct.loss", "1.5", "from 0 to 1"]),
        ('[access]\npolicy = "aloha"', ["f.toml:2", "access.policy", '"aloha"', '"minislot"']),
        ("[access]\npersist = 0", ["access.persist", "got 0", "above 0"]),
        ("[access]\nnodes = [1, 255]", ["access.nodes", "255", "from 0 to 254"]),
        (
            '[access]\npolicy = "csma"',
            ["f.toml: access.policy", '"csma"', '"direct" has no channel', '"none", or a backend'],
        ),
        (
            'backend = "loopback"\n[access]\npolicy = "tdma"\nnodes = [2, 3]',
            ["f.toml: access.nodes", "[2, 3]", "this robot's 1 among them"],
        ),
        (
            'backend = "loopback"\n[access]\npolicy = "minislot"\nnodes = [1, 2, 1]',
            ["f.toml: access.nodes", "[1, 2, 1]", "each robot once"],
        ),
        (
            "[rate]\nmin_mcs = 3\nmax_mcs = 2",
            ["f.toml: rate.min_mcs", "got 3", "at most rate.max_mcs, 2"],
        ),
        ("[rate]\nmax_mcs = 10", ["f.toml:2: rate.max_mcs", "got 10", "from 0 to 9"]),
        (
            "[link]\nbeacon_s = 0\n[rate]\nadapt = true",
            ["f.toml: rate.adapt", "got true", "link.beacon_s", "allowed here: false"],
        ),
        ('backend = "ether"', ["f.toml: ether.dir", 'got ""', "sdrlink-ether --dir"]),
        ("[play]\nduration_s = -1", ["f.toml:2: play.duration_s", "got -1", "from 0 to"]),
        ("[modem]\ncarrier_db = 1", ["modem.carrier_db", "got 1", "from 3 to 40"]),
    ],
)  # fmt: skip
def test_an_error_cites_key_given_and_allowed(text, parts):
    with pytest.raises(UserError) as error:
        make_setup(parse_config(text, "f.toml"), ETC, "f.toml")
    message = str(error.value)
    assert "\n" not in message
    for part in parts:
        assert part in message


def test_check_says_what_the_flush_time_means():
    summary = make_setup(parse_config("[link]\nflush_s = 0.0"), ETC).summary()
    assert any("link.flush_s = 0.0: a partly filled PDU waits until" in each for each in summary)
    assert any('link.flush_s = "now"' in each for each in make_setup(Config(), ETC).summary())


def test_topics_are_taken_under_the_namespace_and_republished_by_source():
    setup = make_setup(Config(topics=["odom", "/scan"]), ETC)
    assert setup.topics_in == {"/robot_1/scan": 0, "/robot_1/odom": 1}
    assert setup.republished_as(7, 1) == "/rx_robot_7/odom"


def test_a_topic_that_can_be_too_large_is_warned_about():
    setup = make_setup(parse_config("[link]\npdu_size = 64"), ETC)
    assert any("map" in warning and "13005 B" in warning for warning in setup.all_warnings)


def test_a_missing_registry_says_what_it_is(tmp_path):
    with pytest.raises(RegistryError, match="registry is unreadable"):
        make_setup(Config(registry="registry.csv"), tmp_path)


def test_without_a_registry_producers_declare_topics(tmp_path):
    setup = make_setup(Config(topic={"/odom": TopicPolicy(priority=9)}), tmp_path)
    assert (len(setup.registry), setup.topics_in, setup.has_numbers) == (0, {}, True)
    assert setup.table.of("odom", "std_msgs/msg/String") == TopicPolicy(priority=9)
    assert "producers declare topics" in setup.summary()
    (tmp_path / "registry.csv").write_text("odom,nav_msgs/Odometry\n")
    setup = make_setup(Config(), tmp_path)
    assert (list(setup.topics_in), setup.has_numbers) == (["/robot_1/odom"], False)
    assert make_setup(Config(auto=True), tmp_path).has_numbers


@pytest.mark.parametrize(
    ("n_topics", "auto", "says"),
    [
        (14, True, None),
        (15, True, "auto: got true; it needs topic id 14, but the registry has 15 topics"),
        (16, True, "at most 14 topics"),
        (15, None, None),
        (0, False, "auto: got false, but there is no registry"),
    ],
)
def test_numbers_need_topic_id_14(tmp_path, n_topics, auto, says):
    if n_topics:
        text = "".join(f"topic_{i},std_msgs/String\n" for i in range(n_topics))
        (tmp_path / "registry.csv").write_text(text)
    if says is None:
        assert make_setup(Config(auto=auto), tmp_path).has_numbers == bool(auto)
    else:
        with pytest.raises(ConfigError, match=says):
            make_setup(Config(auto=auto), tmp_path)


def test_a_policy_holds_for_commands_to_this_robot_too(tmp_path):
    slow, fast = TopicPolicy(deadman_s=0.3), TopicPolicy(deadman_s=0.1)
    given = {"cmd_vel": slow, "goal": slow, "robot_2/goal": fast}
    setup = make_setup(Config(namespace="robot_2", topic=given), tmp_path)
    of = setup.table.configured
    assert (of("robot_2/cmd_vel"), of("cmd_vel")) == (slow, slow)
    assert of("robot_2/goal") == fast, "a policy of its own"


ODOMETRY, TWIST, STRING = (
    "nav_msgs/msg/Odometry", "geometry_msgs/msg/Twist", "std_msgs/msg/String",
)  # fmt: skip


def test_every_shipped_policy_names_a_ros_type_and_changes_something():
    table = policies_by_type()
    for kinds in (table.type, table.command):
        for kind, policy in kinds.items():
            assert topic_type(kind) == kind
            assert policy.given
            assert policy.offer
    assert table.command.keys() <= table.type.keys()
    for policy in table.command.values():
        assert policy.qos == "urgent", "what moves a robot goes first"
        assert 0 < policy.own_lifespan_s <= policy.deadman_s


@pytest.mark.parametrize(
    ("text", "kind", "is_command", "says"),
    [
        ("", ODOMETRY, False, TopicPolicy(qos="latency", depth=1, lifespan_s=5.0)),
        ("", STRING, False, TopicPolicy(depth=9, lifespan_s=5.0)),
        ("[topic.x]\ndepth = 3", ODOMETRY, False,
         TopicPolicy(qos="latency", depth=3, lifespan_s=5.0)),
        # Also a value that is the default is given.
        ("[topic.x]\ndepth = 0\nqos = 'default'", ODOMETRY, False, TopicPolicy(lifespan_s=5.0)),
        ("[topic.x]\noffer = false", ODOMETRY, True, TopicPolicy(offer=False)),
        ("", TWIST, False,
         TopicPolicy(qos="latency", depth=1, max_bytes=1024, lifespan_s=5.0)),
        ("", TWIST, True, TopicPolicy(
            qos="urgent", depth=1, max_bytes=1024, lifespan_s=0.3, deadman_s=0.5)),
        ("[topic.x]\ndeadman_s = 0", TWIST, True,
         TopicPolicy(qos="urgent", depth=1, max_bytes=1024, lifespan_s=0.3)),
    ],
)  # fmt: skip
def test_a_file_wins_over_the_type_and_the_type_over_the_offer(
    tmp_path, text, kind, is_command, says
):
    table = make_setup(parse_config(text), tmp_path).table
    offered = TopicPolicy(depth=9, lifespan_s=5.0)
    assert table.made("x", kind, offered, is_command=is_command) == says
    origins = table.origins("x", kind, offered)
    assert origins[0] == ("file" if text else "offer" if kind == STRING else "type")
    gives_all = "offer = false" in text or "qos" in text
    assert ("type" in origins) == (kind != STRING and not gives_all)
    assert ("offer" in origins) == ("offer" not in text)


def test_static_transforms_are_latched_wherever_they_are():
    table = make_setup(parse_config(""), ETC).table
    for name in ("tf_static", "robot_2/tf_static"):
        assert table.of(name, TF_TYPE).latched == 1
    assert table.of("tf", TF_TYPE) == TopicPolicy(qos="latency", depth=1, key="child_frames")


def test_a_policy_of_a_declared_topic_needs_a_ros_name(tmp_path):
    with pytest.raises(ConfigError, match="allowed: a ROS name"):
        make_setup(Config(topic={"no name": TopicPolicy()}), tmp_path)


def test_a_missing_or_binary_file_is_a_user_error(tmp_path):
    with pytest.raises(UserError, match="--config"):
        load_config(tmp_path / "none.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UserError, match="not a text in UTF-8"):
        load_config(tmp_path / "binary.toml")


def test_file_names_are_relative_to_the_configuration(tmp_path):
    (tmp_path / "registry.csv").write_text("odom,nav_msgs/Odometry\n")
    text = 'backend = "ether"\n[ether]\ndir = "hub"\n[play]\nbag = "a.mcap"'
    setup = make_setup(parse_config(text), tmp_path)
    assert setup.config.ether.dir == str(tmp_path / "hub")
    assert setup.config.play.bag == str(tmp_path / "a.mcap")
    assert make_setup(Config(), ETC).config.play.bag == ""


def test_a_whole_radio_configuration_is_taken():
    text = """
backend = "loopback"
[access]
policy = "minislot"
nodes = [1, 2, 3]
[rate]
adapt = true
min_mcs = 1
"""
    config = make_setup(parse_config(text), ETC).config
    assert (config.access.nodes, config.rate.min_mcs) == ([1, 2, 3], 1)


@pytest.mark.parametrize(
    ("text", "where", "value"),
    [
        ('drain_s = "300 ms"', "drain_s", 0.3),
        ('[topic.odom]\nlifespan_s = "300ms"', "topic.odom.lifespan_s", 0.3),
        ('[topic.odom]\nlifespan_s = "inf"', "topic.odom.lifespan_s", float("inf")),
        ('[classes.bulk]\nmax_burst_s = "2 ms"', "classes.bulk.max_burst_s", 0.002),
        ('[modem]\nfrequency_hz = "433.92 MHz"', "modem.frequency_hz", 433.92e6),
        ('[modem]\nrate_hz = "2 Msps"', "modem.rate_hz", 2e6),
        ('[modem]\nmax_cfo_hz = "20 kHz"', "modem.max_cfo_hz", 2e4),
        ('[gnuradio]\nrate_bit_s = "1.5 Mbit/s"', "gnuradio.rate_bit_s", 1.5e6),
        ('[access]\nslot_s = "0.3 s"', "access.slot_s", 0.3),
    ],
)
def test_times_frequencies_and_rates_take_a_unit(text, where, value):
    found = parse_config(text)
    for step in where.split("."):
        found = found[step] if isinstance(found, dict) else getattr(found, step)
    assert found == pytest.approx(value)


def test_text_stays_text_where_no_quantity_is_wanted():
    assert parse_config('[soapy]\nsettings = { a_s = "5 ms" }').soapy.settings == {"a_s": "5 ms"}
    with pytest.raises(ConfigError, match=r"from 32 to 2047$"):
        parse_config('[link]\npdu_size = "64 ms"')


@pytest.mark.parametrize(
    "form", ["/rx_robot_{src_id}", "/a/r{src}/b/", "/r{src_id}/from_{src_id}"]
)  # fmt: skip
def test_where_another_robots_messages_appear_is_the_name_of_its_topic(form):
    text = f'namespace = "robot_7"\nrx_format = "{form}"\nauto = true\n[fleet]\nbridge = ["*"]'
    setup = make_setup(parse_config(text), ETC)
    for robot in (0, 1, 254):
        there = setup.republished(robot, "camera/image")
        assert setup.name_on_air(there) == f"@{robot}/camera/image"
        assert setup.republished(8, f"@{robot}/camera/image") == there
    assert setup.name_on_air(setup.republished(255, "odom")) == setup.republished(255, "odom")[1:]
    assert setup.name_on_air("/robot_7/odom") == "odom"
    assert setup.name_on_bus("odom") == "/robot_7/odom"


def test_without_a_bridge_a_name_is_this_robots_own():
    setup = make_setup(Config(namespace="robot_7", rx_format="/robot_{src_id}"), ETC)
    assert setup.name_on_air("/robot_7/odom") == "odom"
    assert setup.name_on_air("/robot_2/cmd_vel") == "robot_2/cmd_vel"


def test_commands_and_what_is_bridged_have_different_names():
    text = 'auto = true\nrx_format = "/robot_{src}/"\n[fleet]\nbridge = ["odom"]'
    with pytest.raises(ConfigError, match=r"rx_format: got .* the form of commands to robots"):
        make_setup(parse_config(text), ETC)


def test_a_bridge_needs_declared_topics():
    text = 'auto = false\n[fleet]\nbridge = ["odom"]'
    with pytest.raises(ConfigError, match=r"fleet\.bridge: got \['odom'\]; it needs"):
        make_setup(parse_config(text), ETC)
