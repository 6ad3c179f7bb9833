"""Scenarios: every error cites file, line, key, what was given and what is allowed."""

import pytest

from sdrlinkd.errors import ConfigError, UserError
from sdrlinkd.lab import load_scenario, shipped_scenarios
from sdrlinkd.lab.testing import open_sources, outages_of

ONE = "[[robot]]\nid = 1\n"
TWO = "[[robot]]\nid = 2\n"
LINK = "[[link]]\nsender = 1\nreceiver = 2\n"


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ('titel = "x"\n' + ONE, ["s.toml:1: titel", "did you mean title", "duration_s, settle_s"]),
        (ONE + "[air]\nrate = 1e6\n", ["s.toml:4: air.rate", "mean rate_hz", "frequency_hz"]),
        (ONE + "pth = []\n", ["s.toml:3: robot.pth", "did you mean path", "topics, sends"]),
        (ONE + TWO + "send = true\n", ["s.toml:5: robot.send", "did you mean sends"]),
        (
            ONE + "radio = { clock_pm = 3.0 }\n",
            ["s.toml:3: robot.radio.clock_pm", "did you mean clock_ppm", "turnaround_s"],
        ),
        (
            ONE + "[robot.radio]\nduplex = true\n",
            ["s.toml:4: robot.radio.duplex", "did you mean full_duplex"],
        ),
        (
            ONE + TWO + LINK + "snr = 3.0\n",
            ["s.toml:8: link.snr", "did you mean snr_db", "sender, receiver"],
        ),
        (ONE + "[outages]\ntime = []\n", ["s.toml:4: outages.time", "did you mean times"]),
        ("colour = 1\n" + ONE, ["s.toml:1: colour: unknown key; allowed: title"]),
        ('pace = "fast"\n' + ONE, ["s.toml:1: pace", '"fast"', '"lockstep", "realtime"']),
        ("duration_s = 0\n" + ONE, ["s.toml:1: duration_s", "got 0", "a number"]),
        ("[air]\nrate_hz = 1\n" + ONE, ["s.toml:2: air.rate_hz", "got 1", "from 10000"]),
        ("daemon = 3\n" + ONE, ["s.toml:1: daemon", "got 3", "a table"]),
        ("robot = 3", ["s.toml:1: robot", "got 3", "a list", "a table"]),
        (ONE + 'path = [[0, "a", 0]]\n', ["s.toml:3: robot.path", '"a"', "a number"]),
        (ONE + TWO + LINK + "snr_db = 500\n", ["link.snr_db", "500", "from -300 to 300"]),
        ("[[robot]]\nid = 255\n", ["s.toml:2: robot.id", "got 255", "from 0 to 254"]),
        ("nonsense", ["s.toml:1: not TOML"]),
    ],
)  # fmt: skip
def test_an_error_cites_file_line_key_given_and_allowed(load, text, parts):
    with pytest.raises(ConfigError) as error:
        load(text)
    message = str(error.value)
    assert "\n" not in message
    for part in parts:
        assert part in message


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("", ["s.toml: robot: has no robot"]),
        ("[[robot]]\nsends = true\n", ["s.toml:1: robot: has no id", "from 0 to 254"]),
        (ONE + TWO + "[[link]]\nreceiver = 1\n", ["s.toml:5: link: has no sender"]),
        (ONE + TWO + "[[link]]\nsender = 1\n", ["s.toml:5: link: has no receiver"]),
    ],
)
def test_what_is_missing_is_named(load, text, parts):
    with pytest.raises(ConfigError) as error:
        load(text)
    for part in parts:
        assert part in str(error.value)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("robot = []", ["robot: got []", "1"]),
        (ONE + "path = [[0, 1]]\n", ["s.toml:3: robot.path", "got [0, 1]", "3"]),
        (ONE + "[outages]\ntimes = [[1, 2, 3]]\n", ["outages.times", "got [1, 2, 3]", "2"]),
    ],
)
def test_a_list_of_the_wrong_length_is_told_the_right_one(load, text, parts):
    with pytest.raises(ConfigError) as error:
        load(text)
    given, _, allowed = str(error.value).partition("; allowed: ")
    assert parts[-1] in allowed
    for part in parts[:-1]:
        assert part in given


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (ONE + "[[robot]]\nid = 999\n", "s.toml:4: robot.id: got 999"),
        ("[[robot]]\nsends = true\n" + TWO, "s.toml:1: robot: has no id"),
        (ONE + "radio = {}\n" + TWO + "radio = { mhz = 1 }\n", "s.toml:6: robot.radio.mhz"),
    ],
)
def test_the_line_cited_is_that_of_the_robot_in_error(load, text, says):
    with pytest.raises(ConfigError) as error:
        load(text)
    assert says in str(error.value)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (
            ONE + "path = [[0, 0, 0], [5, 1, 0], [5, 2, 0]]\n",
            ["robot.path of robot 1", "t = 5 s after 5 s", "increasing times"],
        ),
        (ONE + "path = [[5, 0, 0], [4, 1, 0]]\n", ["t = 4 s after 5 s"]),
        (
            ONE + TWO + "path = [[0, 0, 0], [1, 30000, 40000]]\n",
            ["robot.path of robot 2", "5e+04 m/s", "from 0 s to 1 s", "at most 10000 m/s"],
        ),
        (ONE + TWO + ONE, ["robot.id: got 1 twice", "a unique id"]),
        (
            ONE + TWO + "[[link]]\nsender = 1\nreceiver = 3\n",
            ["link.receiver: got 3", "a robot of this scenario: 1, 2"],
        ),
        (ONE + TWO + "[[link]]\nsender = 0\nreceiver = 2\n", ["link.sender: got 0"]),
        (
            ONE + TWO + "[[link]]\nsender = 2\nreceiver = 2\n",
            ["link: got robot 2 to itself", "two robots"],
        ),
        (
            ONE + "[outages]\ntimes = [[1, 2], [4, 3]]\n",
            ["outages.times: got [4, 3]", "an end after its start"],
        ),
        (ONE + "[outages]\ntimes = [[3, 3]]\n", ["got [3, 3]"]),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(load, text, parts):
    with pytest.raises(ConfigError) as error:
        load(text)
    message = str(error.value)
    assert "s.toml: " in message
    assert "allowed: " in message
    for part in parts:
        assert part in message


@pytest.mark.parametrize(
    "text",
    [
        ONE + "path = [[0, nan, 0]]\n",
        ONE + "path = [[0, inf, 0]]\n",
        ONE + "path = [[nan, 0, 0]]\n",
        ONE + "path = [[0, 0, 0], [nan, 1, 0]]\n",
        ONE + "path = [[0, inf, 0], [1, inf, 0]]\n",
        ONE + "[outages]\ntimes = [[nan, 2]]\n",
        ONE + "[outages]\ntimes = [[1, nan]]\n",
        "duration_s = nan\n" + ONE,
        "[air]\nsnr_db = nan\n" + ONE,
    ],
)
def test_a_place_or_a_time_that_is_no_number_is_refused(load, text):
    with pytest.raises(ConfigError, match="allowed"):
        load(text)


@pytest.mark.parametrize("seed", ["-1", "99999999999999999999"])
def test_a_seed_that_the_hub_cannot_take_is_refused(load, seed):
    with pytest.raises(ConfigError, match="seed"):
        load(f"seed = {seed}\n" + ONE)


def test_a_file_that_is_no_scenario_is_a_user_error(tmp_path):
    with pytest.raises(UserError, match="cannot be read"):
        load_scenario(tmp_path / "none.toml")
    with pytest.raises(UserError, match="cannot be read"):
        load_scenario(tmp_path)
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UserError, match="binary"):
        load_scenario(tmp_path / "binary.toml")


def test_outages_may_lie_within_each_other(load):
    scenario = load(ONE + "[outages]\ntimes = [[1, 10], [2, 3], [4, 4.5], [20, 21]]\n")
    world = scenario.world(outages_of(scenario, None))
    times = (0.9, 1, 2.5, 3.5, 9.9, 10, 20.5)
    assert [world.is_out(t) for t in times] == [False, True, True, True, True, False, True]


@pytest.mark.parametrize(
    ("text", "reach"),
    [
        ("", [(1, 2), (2, 1)]),
        (LINK + "snr_db = -300\n", []),
        (LINK + "snr_db = -300\none_way = true\n", [(2, 1)]),
        ("[air]\nsnr_db = -10\n", []),
        ("[air]\nsnr_db = -10\n" + LINK + "snr_db = 5\n", [(1, 2), (2, 1)]),
        ("[outages]\ntimes = [[0, 100]]\n", [(1, 2), (2, 1)]),
    ],
)
def test_who_can_ever_hear_whom(load, text, reach):
    scenario = load(ONE + TWO + text)
    found = [pair for pair in ((1, 2), (2, 1)) if scenario.in_reach(*pair)]
    assert found == reach


@pytest.mark.parametrize(
    ("path", "is_heard"),
    [
        ("[[0, 5, 0]]", True),
        ("[[0, 5000, 0]]", False),
        ("[[0, 5000, 0], [20, 5, 0]]", True),
        ("[[0, 5000, 0], [10, 5, 0], [11, 5000, 0]]", True),
        ("[[0, 5000, 0], [20, 4000, 0], [30, 5, 0]]", False),
    ],
)
def test_who_comes_near_while_it_lasts_is_in_reach(load, path, is_heard):
    text = "duration_s = 20\n[air]\nsnr_db_at_1m = 50\n" + ONE + "path = [[0, 0, 0]]\n" + TWO
    assert load(text + f"path = {path}\n").in_reach(1, 2) == is_heard


def test_shipped_scenarios_need_no_recording_but_one_that_says_so():
    for name, path in shipped_scenarios().items():
        scenario = load_scenario(path)
        if name == "mrclam-three":
            with pytest.raises(UserError, match="give a recording that has it with --bag"):
                open_sources(scenario, None)
            continue
        for source in open_sources(scenario, None).values():
            assert source.topics, name


def test_a_robot_whose_radio_is_off_neither_hears_nor_is_heard(load):
    text = ONE + "off = [[2, 3], [2.5, 4], [9, 100]]\n" + TWO
    scenario = load(text)
    world = scenario.world([])
    for t, is_on in ((0.0, True), (2.0, False), (3.5, False), (4.0, True), (50.0, False)):
        assert world.is_off(1, t) != is_on
        assert (world.hop(1, 2, t) is not None) == is_on
        assert (world.hop(2, 1, t) is not None) == is_on
    with pytest.raises(ConfigError, match=r"robot.off of robot 1: got \[4, 3\]"):
        load(ONE + "off = [[4, 3]]\n" + TWO)
    with pytest.raises(ConfigError, match=r"air.jammer.times: got \[4, 3\]"):
        load("[[air.jammer]]\ntimes = [[4, 3]]\n" + ONE + TWO)


def test_where_robots_relay_those_beyond_are_in_reach(load):
    links = "[[link]]\nsender = 1\nreceiver = 3\nsnr_db = -300\n"
    text = ONE + TWO + "[[robot]]\nid = 3\n" + links
    assert not load(text).in_reach(1, 3)
    assert load(text + '[daemon.relay]\npolicy = "auto"\n').in_reach(1, 3)
    alone = text + "[[link]]\nsender = 2\nreceiver = 3\nsnr_db = -300\n"
    assert not load(alone + '[daemon.relay]\npolicy = "auto"\n').in_reach(1, 3)


def test_the_mine_is_whole():
    mine = load_scenario(shipped_scenarios()["mine"])
    assert all(mine.in_reach(one.id, other.id) for one in mine.robot for other in mine.robot)
    assert mine.hop_limit == 8
