"""The configuration of daemons: shipped scenarios are valid, and [daemon] has its limits."""

import pytest

from sdrlinkd.config import load_config, make_setup
from sdrlinkd.errors import ConfigError, UserError
from sdrlinkd.lab import load_scenario
from sdrlinkd.lab.testing import open_sources
from tests.adapters.recordings import STORAGES, ros2_bag
from tests.lab.scenarios import SHIPPED, write_scenario

THREE_ROBOTS = [
    (
        f"/robot{robot}/odom",
        "nav_msgs/msg/Odometry",
        100_000_000 * i + robot,
        b"\0\1\0\0" + bytes(716),
    )
    for i in range(20)
    for robot in (1, 2, 3)
]
MESSAGES = {"mrclam-three": THREE_ROBOTS}
"""Messages in bags like those for which the scenarios are made."""

ONE = "[[robot]]\nid = 1\n"
TWO = "[[robot]]\nid = 2\n"


def test_there_are_scenarios():
    assert len(list(SHIPPED.glob("*.toml"))) >= 6


@pytest.mark.parametrize("path", sorted(SHIPPED.glob("*.toml")), ids=lambda path: path.stem)
def test_a_shipped_scenario_is_one_that_daemons_take(path, tmp_path, write_configs):
    bag = None
    if path.stem in MESSAGES:
        bag = ros2_bag(tmp_path / "bag", STORAGES["sqlite3"], MESSAGES[path.stem])
    scenario = load_scenario(path)
    assert scenario.title
    configs = write_configs(scenario, bag)
    ids = [robot.id for robot in scenario.robot]
    assert len(configs) == len(ids) > 1
    for config, robot in zip(configs, scenario.robot, strict=True):
        setup = make_setup(load_config(config), config.parent)
        assert setup.node_id == robot.id
        assert len(setup.topics_in) == (len(robot.topics) or 4)
        assert setup.config.modem.rate_hz == scenario.air.rate_hz
        assert setup.config.access.nodes == ids
        is_planned = scenario.pace == "lockstep" and robot.sends
        assert setup.config.play.duration_s == (scenario.duration_s if is_planned else 0)
        assert (setup.config.play.bag == str(bag)) == (bag is not None)


def test_each_robot_has_a_chance_of_its_own(load, write_configs):
    configs = write_configs(load('pace = "lockstep"\nseed = 7\n' + ONE + TWO))
    assert [load_config(config).seed for config in configs] == [7001, 7002]


@pytest.mark.parametrize(
    ("section", "parts"),
    [
        ("[daemon.modm]\n", ["modm", "unknown key", "did you mean modem"]),
        ("[daemon.topic.cmd_vel]\nlife = 1.0\n", ["topic.cmd_vel.life", "lifespan_s"]),
        ("[daemon.queue]\nmax_message = 5\n", ["queue.max_message", "did you mean max_messages"]),
        ("[daemon.link]\npdu_size = 5\n", ["link.pdu_size", "got 5", "from 32 to 2047"]),
        ("[daemon.rate]\nadapt = 1\n", ["rate.adapt", "got 1", "true or false"]),
        ("[daemon.link]\nbeacon_s = -1\n", ["link.beacon_s", "got -1"]),
    ],
)
def test_a_daemon_section_that_daemons_refuse_names_the_scenario(
    tmp_path, write_configs, section, parts
):
    scenario = load_scenario(write_scenario(tmp_path, extra=section))
    with pytest.raises(ConfigError) as error:
        write_configs(scenario)
    for part in ["s.toml", "daemon", *parts]:
        assert part in str(error.value)


def test_the_line_cited_for_a_daemon_section_is_one_of_the_scenario(tmp_path, write_configs):
    scenario = load_scenario(write_scenario(tmp_path, extra="[daemon.link]\npdu_sise = 64\n"))
    with pytest.raises(ConfigError) as error:
        write_configs(scenario, name="small.toml")
    lines = (tmp_path / "small.toml").read_text().splitlines()
    at = lines.index("pdu_sise = 64") + 1
    assert "link.pdu_sise" in str(error.value)
    cited = [word.strip(":") for word in str(error.value).split(":") if word.strip().isdigit()]
    assert cited in ([], [str(at)])


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("rate_hz = 2e6", ["daemon.modem.rate_hz: got 2e+06", "that of [air], 1e+06"]),
        ("frequency_hz = 1e9", ["daemon.modem.frequency_hz: got 1e+09", "[air], 2.45e+09"]),
        ('rate_hz = "fast"', ["modem.rate_hz", '"fast"']),
    ],
)
def test_daemons_are_on_the_scenarios_air(load, write_configs, text, parts):
    air = "[air]\nrate_hz = 1e6\n"
    with pytest.raises(ConfigError) as error:
        write_configs(load(air + ONE + f"[daemon.modem]\n{text}\n"))
    for part in ["s.toml", *parts]:
        assert part in str(error.value)


def test_the_airs_own_rate_may_be_said_again(load, write_configs):
    text = "[air]\nrate_hz = 1e6\n" + ONE + "[daemon.modem]\nrate_hz = 1_000_000\n"
    (config,) = write_configs(load(text))
    assert load_config(config).modem.rate_hz == 1e6


@pytest.mark.parametrize("section", ["modem", "access", "ether", "bus"])
def test_a_daemon_section_that_is_no_table_is_refused(load, write_configs, section):
    with pytest.raises(ConfigError, match=f"{section}: got 3; allowed: a table"):
        write_configs(load(ONE + f"[daemon]\n{section} = 3\n"))


@pytest.mark.parametrize(
    "text",
    [
        'backend = "direct"',
        "robot_id = 9",
        'namespace = "robot_9"',
        "seed = 9",
        'topics = ["odom"]',
        'rx_format = "/heard_{src_id}"',
        'registry = "other.csv"',
        'bus.runtime_dir = "/tmp/x"',
        'ether.dir = "/tmp/x"',
        "play = { duration_s = 1.0 }",
    ],
)
def test_what_the_lab_itself_says_no_daemon_section_may(load, write_configs, text):
    key = text.split(" =")[0]
    with pytest.raises(ConfigError, match=f"daemon.{key}"):
        write_configs(load(ONE + TWO + f"[daemon]\n{text}\n"))


def test_a_topic_that_the_robot_does_not_have_is_told_with_the_scenarios_key(load):
    with pytest.raises(UserError) as error:
        open_sources(load('[[robot]]\nid = 1\ntopics = ["cmd_vl"]\n'), None)
    for part in ("topics", "cmd_vl", "allowed", "/robot_1/cmd_vel"):
        assert part in str(error.value)
    assert "--topics" not in str(error.value), "the lab has no such option"
