"""Teams of real ROS 2 nodes in domains of their own, over bridges, daemons and simulated air."""

import time

import pytest

from tests.ros.programs import Agent
from tests.ros.team import (
    CARRIER,
    GRID,
    IMU,
    ODOM,
    SCAN,
    TEXT,
    TWIST,
    WAIT_S,
    Robot,
    ask,
    config,
    is_part,
    matched,
    transforms,
)
from tests.waiting import wait_for

pytestmark = pytest.mark.realtime(most_s=20)

SECONDS = 3
"""How long the robots of a team send."""
TRIES = 3
"""A team is run again, twice at most, if this machine was too busy for the radios."""


def test_a_team_sees_each_others_topics_without_configuration(start_daemon, start, hub):
    for _ in range(TRIES):
        robots = run_team(start_daemon, start, hub)
        if robots is None:
            break
        # The counters say that this machine lost samples.
        for robot in robots:
            robot.bridge.kill()
            robot.daemon.stop()
    else:
        pytest.fail("this machine loses samples")


def run_team(start_daemon, start, hub):
    """Run a team through; its robots if the machine was too busy, else None."""
    one = Robot(start, start_daemon(config(hub, 1))).bridged()
    # Published before the far robot and its bridge start.
    one.node.pub(topic="/map", type=GRID, latched=True, depth=1)
    one.node.send(topic="/map", first=7)
    for key in ("lidar", "camera", "gps"):
        one.node.pub(topic="/tf_static", type=CARRIER, key=key, latched=True, depth=1)
        one.node.raw(topic="/tf_static", octets=transforms(key), key=key)
    flows = (ODOM, SCAN, IMU)
    for topic, kind, _ in flows:
        one.node.pub(topic=topic, type=kind, best_effort=topic == "/scan")
    one.node.sub(topic="/cmd_vel", type=TWIST)

    two = Robot(start, start_daemon(config(hub, 2))).bridged()
    two.node.pub(topic="/robot_1/cmd_vel", type=TWIST)
    two.node.sub(topic="/robot_1/map", type=GRID, latched=True)
    two.node.sub(topic="/robot_1/tf_static", type=CARRIER, latched=True)
    for topic, kind, _ in flows:
        two.node.sub(topic=f"/robot_1{topic}", type=kind, best_effort=topic == "/scan")
    matched(one, *(topic for topic, _, _ in flows))
    matched(two, "/robot_1/cmd_vel")
    # Its declaration has arrived, too.
    wait_for(lambda: one.node.publishers_of(topic="/cmd_vel") == ["sdrlink_bridge_1"], WAIT_S)

    for topic, _, hz in flows:
        one.node.send(topic=topic, n=SECONDS * hz, hz=hz)
    two.node.send(topic="/robot_1/cmd_vel", n=20 * SECONDS, hz=20)
    for robot in (one, two):
        robot.node.sent()

    def has_all():
        commands = one.node.count(topic="/cmd_vel") + two.superseded("/robot_1/cmd_vel")
        return commands >= 20 * SECONDS and all(
            two.node.count(topic=f"/robot_1{topic}") + one.superseded(topic) >= SECONDS * hz
            for topic, _, hz in flows
        )

    try:
        wait_for(has_all, 10.0)
    except AssertionError:
        if one.samples_lost or two.samples_lost:
            return one, two
        raise
    for topic, kind, hz in flows:
        got = two.node.got(topic=f"/robot_1{topic}")
        assert is_part(got, one.node.expect(type=kind, first=0, n=SECONDS * hz)), topic
    assert is_part(
        one.node.got(topic="/cmd_vel"), two.node.expect(type=TWIST, first=0, n=20 * SECONDS)
    )
    wait_for(lambda: two.node.count(topic="/robot_1/tf_static") == 3, 10.0)
    assert two.node.got(topic="/robot_1/map") == one.node.expect(type=GRID, first=7, n=1)

    # The far bridge crashes; who comes late gets what was latched.
    two.bridge.kill()
    two.bridged()
    two.bridge.says("bridge of robot 2")
    late = start(Agent, two.domain, "late")
    late.sub(topic="/robot_1/map", type=GRID, latched=True)
    late.sub(topic="/robot_1/tf_static", type=CARRIER, latched=True)
    begin = time.monotonic()
    wait_for(
        lambda: [late.count(topic=f"/robot_1/{each}") for each in ("map", "tf_static")] == [1, 3],
        WAIT_S,
    )
    print(f"what was latched came {time.monotonic() - begin:.2f} s after the bridge")  # noqa: T201
    assert late.got(topic="/robot_1/map") == one.node.expect(type=GRID, first=7, n=1)
    got = [bytes.fromhex(each) for each in late.got_raw(topic="/robot_1/tf_static")]
    sent = [bytes.fromhex(transforms(key)) for key in ("lidar", "camera", "gps")]
    assert {next(s for s in sent if each.startswith(s)) for each in got} == set(sent)
    for robot in (one, two):
        # Nothing came back to where it came from.
        assert ask(robot.daemon, "check")["problems"] == []
    names = one.node.names()
    assert not [name for name in names if name.startswith(("/robot_1/", "/rx_"))], names
    assert not [name for name in two.node.names() if name.startswith("/robot_2/")]
    return None


@pytest.mark.long
def test_commands_go_one_way_though_the_robots_own_planner_uses_the_name(start_daemon, start, hub):
    each = "[topic.cmd_vel]\ndepth = 0\nlifespan_s = inf\n"
    one = Robot(start, start_daemon(config(hub, 1, each))).bridged().watched()
    two = Robot(start, start_daemon(config(hub, 2, each + "deadman_s = 1.0\n"))).bridged().watched()
    # Like Nav2, the robot publishes and hears its own commands.
    two.node.pub(topic="/cmd_vel", type=TWIST)
    two.node.sub(topic="/cmd_vel", type=TWIST)
    two.node.pub(topic="/battery", type=TEXT)
    two.node.pub(topic="/led", type=TEXT)
    one.node.pub(topic="/robot_2/cmd_vel", type=TWIST)
    one.node.sub(topic="/robot_2/battery", type=TEXT)
    wait_for(lambda: len(two.node.publishers_of(topic="/cmd_vel")) == 2, WAIT_S)
    matched(two, "/battery")
    matched(one, "/robot_2/cmd_vel")
    two.says_of("/cmd_vel", "never go the other way")
    two.node.send(topic="/cmd_vel", first=100, n=10)
    wait_for(lambda: two.node.count(topic="/cmd_vel") == 10, WAIT_S)
    one.node.send(topic="/robot_2/cmd_vel", first=0, n=20, hz=20)
    one.node.sent()
    # The last one is the stop message of the silent topic.
    wait_for(lambda: two.node.count(topic="/cmd_vel") == 31, WAIT_S)
    got = two.node.got(topic="/cmd_vel")
    assert got[:10] == two.node.expect(type=TWIST, first=100, n=10)
    assert got[10:30] == two.node.expect(type=TWIST, first=0, n=20)
    assert two.node.last(topic="/cmd_vel") == [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    assert "/robot_2/cmd_vel" not in [
        f"/robot_{each['robot']}/{each['name']}" for each in ask(one.daemon, "declared")
    ]
    # A name that robot 2 sends cannot be commanded, too.
    one.node.pub(topic="/robot_2/led", type=TEXT)
    one.bridge.says("/robot_2/led: robot 2 sends it, and /node here commands it")
    assert two.node.publishers_of(topic="/led") == ["node"]


@pytest.mark.long
def test_twelve_of_sixty_topics_are_wanted_and_only_these_are_on_the_air(start_daemon, start, hub):
    one = Robot(start, start_daemon(config(hub, 1))).bridged()
    two = Robot(start, start_daemon(config(hub, 2))).bridged()
    topics = [f"/sensors/number_{i}" for i in range(60)]
    for topic in topics:
        one.node.pub(topic=topic, type=TEXT)
    wanted = topics[::5]
    for topic in wanted:
        two.node.sub(topic=f"/robot_1{topic}", type=TEXT)
    matched(one, *wanted)
    for topic in topics:
        one.node.send(topic=topic)
    for topic in wanted:
        wait_for(lambda topic=topic: two.node.count(topic=f"/robot_1{topic}") == 1, WAIT_S)
    sent = ask(one.daemon, "status")["link"]["topics"]
    assert sorted(f"{each['name']}" for each in sent if each["accepted"]) == sorted(wanted)
    assert set(ask(one.daemon, "demand")["wanted"]) == set(wanted)
    names = two.node.names()
    assert all(f"/robot_1{topic}" in names for topic in topics), "all can be seen"
