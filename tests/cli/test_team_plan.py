"""`plan --team` and `set --reserve`: the screen, the words, and what is refused in a sentence."""

import msgspec
import pytest

from sdrlinkd.cli.reserving import asked_air, verdict_words
from sdrlinkd.cli.screens import team_screen
from sdrlinkd.errors import UserError
from sdrlinkd.reports import AdmissionReport, ReservedFlowReport
from tests.cli.pictures import assert_stored, drawn

FLOW = ReservedFlowReport(
    src=1, topic_id=0, name="scan", qos="latency", priority=64, dst=255, via=[2], rate_hz=50.0,
    size=1000, air_pct=14.8, admitted=True,
)  # fmt: skip


def changed(**fields):
    return msgspec.structs.replace(FLOW, **fields)


TEAM = AdmissionReport(
    planner=2,
    limit_pct=83.2,
    admitted_pct=76.1,
    flows=[
        FLOW,
        changed(topic_id=17, name="", qos="bulk", via=[], dst=2, admitted=None, air_pct=3.0),
        changed(src=3, name="camera", qos="bulk", rate_hz=6.67, size=65536, air_pct=61.3),
        changed(src=4, name="camera", qos="bulk", size=65536, air_pct=122.6, admitted=False),
    ],
)


def test_the_screen_is_the_stored_one():
    worst_s = {(1, 0): 0.0466, (1, 17): 0.2, (3, 0): float("inf")}
    assert_stored("team", drawn(*team_screen(1, TEAM, worst_s)))


def test_without_worst_cases_there_is_no_column_for_them():
    assert "worst" not in drawn(*team_screen(1, TEAM))


def test_without_flows_it_says_how_to_get_them():
    assert "reserve = true" in drawn(*team_screen(1, AdmissionReport()))


def test_a_rate_and_a_size_are_asked_for():
    assert asked_air("50:1KB") == {"reserve": True, "period_s": 0.02, "max_bytes": 1000}
    assert asked_air("0.5Hz: 64KiB") == {"reserve": True, "period_s": 2.0, "max_bytes": 65536}
    assert asked_air("none") == {"reserve": False}


@pytest.mark.parametrize("text", ["", "50", "50:", ":1KB", "0:1KB", "1.2.3:1KB", "-1:1KB", "some"])
def test_anything_else_is_refused_with_an_example(text):
    with pytest.raises(UserError, match="such as 50:1KB"):
        asked_air(text)


@pytest.mark.parametrize(
    ("flow", "words"),
    [
        (None, "nothing is reserved yet"),
        (changed(admitted=None), "robot 2 has not answered yet"),
        (FLOW, "admitted by robot 2: it has 14.8 % of the air over its route; 76.1 of 83.2 %"),
        (changed(admitted=False), "refused by robot 2: it needs 14.8 %"),
    ],
)
def test_the_word_of_the_team(flow, words):
    report = msgspec.to_builtins(TEAM)
    told = verdict_words({"flow": msgspec.to_builtins(flow), "report": report})
    assert words in told


def test_a_flow_is_asked_for_while_driving(start_daemon, ctl):
    daemon = start_daemon('namespace = "robot_1"\n')
    where = ("--runtime-dir", daemon.directory)
    code, out, _ = ctl("set", "odom", "--reserve", "50:1KB", *where)
    assert code == 0
    assert "reserve: False -> True" in out
    assert "admitted by robot 1" in out
    code, out, _ = ctl("plan", "--team", *where)
    assert code == 0
    assert "odom" in out
    assert "admitted" in out
    assert "--config" in out
    code, _, err = ctl("plan", "--team", "--config", daemon.config, *where)
    assert code == 2
    assert "direct" in err
    code, out, _ = ctl("plan", "--team", "--json", *where)
    (flow,) = msgspec.json.decode(out, type=AdmissionReport).flows
    assert (flow.name, flow.rate_hz, flow.size, flow.admitted) == ("odom", 50.0, 1000, True)
    assert "admitted by robot 1" in ctl("why", "odom", *where)[1]
    assert ctl("set", "odom", "--max-bytes", "0", *where)[0] != 0
    code, out, _ = ctl("set", "odom", "--reserve", "none", *where)
    assert code == 0
    assert "reserve: True -> False" in out


def test_a_plan_needs_a_configuration_or_a_team(ctl):
    code, _, err = ctl("plan")
    assert code == 2
    assert "--config: missing" in err
