"""The Zenoh session on an event loop: callbacks in order, faults that stay where they are."""

import asyncio
import json
import logging
import time

import pytest
import zenoh
import zenoh.ext

from sdrlinkd.config import FleetParams
from sdrlinkd.errors import ConfigError, UserError
from sdrlinkd.fleet import Answer, make_zenoh_config, open_session
from sdrlinkd.fleet.testing import AT_ONCE, MOST_QUERIES, MOST_SAMPLES
from sdrlinkd.keyring import new_authority, zenoh_file
from tests.fleet.beside import Network, until, until_found
from tests.fleet.conftest import Router
from tests.waiting import wait_for


@pytest.fixture
def router(tmp_path):
    found = Router(tmp_path)
    found.start()
    yield found
    found.stop()


@pytest.fixture
async def session(router, tmp_path):
    opened = await open_session(FleetParams(name="mine", connect=[router.endpoint]), tmp_path)
    yield opened
    await opened.close()


async def test_values_come_in_order_and_one_that_cannot_be_handled_stops_nothing(
    router, session, caplog
):
    caplog.set_level(logging.CRITICAL, logger="asyncio")
    found = []

    def take(sample):
        number = int(sample.payload)
        if number == 7:
            raise ValueError(number)
        found.append(number)

    end = session.subscribe("a/**", take)
    await asyncio.sleep(0.2)
    for number in range(2000):
        router.session.put("a/b", str(number).encode())
    await asyncio.to_thread(wait_for, lambda: len(found) >= 1999)
    assert found == [number for number in range(2000) if number != 7]
    end()
    router.session.put("a/b", b"9999")
    await asyncio.sleep(0.2)
    assert len(found) == 1999


@pytest.fixture
async def network(tmp_path):
    """A session that routes; a plain node joins it when a test wants."""
    network = await Network().open(tmp_path)
    yield network
    await network.close()


REAL_TIME, HIGH, DATA, BACKGROUND = (
    zenoh.Priority.REAL_TIME, zenoh.Priority.INTERACTIVE_HIGH, zenoh.Priority.DATA,
    zenoh.Priority.BACKGROUND,
)  # fmt: skip
BLOCK, DROP = zenoh.CongestionControl.BLOCK, zenoh.CongestionControl.DROP
CLASSES = {
    "urgent": (REAL_TIME, True, BLOCK), "latency": (HIGH, True, BLOCK),
    "default": (DATA, False, BLOCK), "bulk": (BACKGROUND, False, DROP),
    "other": (DATA, False, BLOCK),
}  # fmt: skip


async def test_the_class_sets_priority_and_whether_a_put_may_be_dropped(network):
    await network.join("mine/**")
    near = network.near
    for qos in CLASSES:
        assert near.put(f"mine/put/{qos}", b"1", b"told", qos, "application/cdr")
        assert near.publisher(f"mine/publisher/{qos}", qos, "text/plain", 0)(b"2", None)
        kept = near.publisher(f"mine/kept/{qos}", qos, "application/cdr", 2)
        for each in (b"3", b"4", b"5"):
            assert kept(each, b"told")
    await until(lambda: len(network.came) == 25)
    by_key = {}
    for each in network.came:
        attachment = None if each.attachment is None else each.attachment.to_bytes()
        told = (each.priority, each.express, each.congestion_control)
        assert told == CLASSES[str(each.key_expr).rpartition("/")[2]]
        found = (each.payload.to_bytes(), attachment, str(each.encoding))
        by_key.setdefault(str(each.key_expr), []).append(found)
    for qos in CLASSES:
        assert by_key[f"mine/put/{qos}"] == [(b"1", b"told", "application/cdr")]
        assert by_key[f"mine/publisher/{qos}"] == [(b"2", None, "text/plain")]
        kept = [(each, b"told", "application/cdr") for each in (b"3", b"4", b"5")]
        assert by_key[f"mine/kept/{qos}"] == kept
    late = []
    history = zenoh.ext.HistoryConfig(detect_late_publishers=True)
    subscriber = zenoh.ext.declare_advanced_subscriber(
        network.far, "mine/kept/urgent", lambda each: late.append(each.payload.to_bytes()),
        history=history,
    )  # fmt: skip
    await until(lambda: len(late) == 2)
    assert sorted(late) == [b"4", b"5"]
    subscriber.undeclare()


async def test_a_publisher_that_ends_keeps_nothing_for_later(network):
    await network.join("mine/**")
    put = network.near.publisher("mine/map", "bulk", "", 1)
    put(b"1", None)
    await until(lambda: len(network.came) == 1)
    put.end()
    put.end()
    network.near.publisher("mine/map", "bulk", "", 0).end()
    await until_found(lambda: network.ask("mine/map/@adv/**"), lambda found: not found)


async def test_it_is_reached_from_the_first_node_to_the_last(network):
    near, news = network.near, []
    near.on_reach = news.append
    assert not near.is_reached
    await network.join()
    await until(lambda: near.is_reached)
    second = Network()
    second.endpoint = network.endpoint
    await second.join()
    transports = 2
    await until(lambda: len(list(second.far.info.routers_zid())) == 1)
    await network.part()
    await asyncio.sleep(0.2)
    assert (near.is_reached, news, transports) == (True, [True], 2)
    assert str(second.far.info.routers_zid()[0]) == near.zid
    await second.part()
    await until(lambda: not near.is_reached)
    assert news == [True, False]


async def test_values_of_others_come_with_all_that_they_carry(network):
    await network.join()
    came = []
    network.near.subscribe("a/*", came.append)
    network.near.put("a/own", b"mine", None, "urgent")
    network.far.put("a/1", b"x", attachment=b"told", encoding="text/plain")
    network.far.delete("a/1")
    network.far.put("a/2", b"y")
    await until(lambda: len(came) == 2)
    assert came == [
        ("a/1", b"x", b"told", "text/plain"), ("a/2", b"y", None, "zenoh/bytes"),
    ]  # fmt: skip


async def test_tokens_come_and_go_also_those_that_were_there_before(network):
    await network.join()
    near, seen = network.near, []
    end_near = near.token("mine/near")
    far = network.token("mine/far")
    await asyncio.sleep(0.1)
    end = near.watch("mine/*", lambda key, is_there: seen.append((key, is_there)))
    await until(lambda: len(seen) == 2)
    assert sorted(seen) == [("mine/far", True), ("mine/near", True)]
    far.undeclare()
    await until(lambda: seen[2:] == [("mine/far", False)])
    end_near()
    await until(lambda: seen[3:] == [("mine/near", False)])
    end()
    near.token("mine/more")
    await asyncio.sleep(0.1)
    assert len(seen) == 4


async def test_queries_are_answered_on_the_loop_and_one_that_fails_is_no_end(network, caplog):
    caplog.set_level(logging.CRITICAL, logger="asyncio")
    await network.join()
    asked = []

    def answers(key):
        asked.append(key)
        if "bad" in key:
            raise ValueError(key)
        return [Answer("a/1", b"x", b"told"), Answer("a/2", b"y")]

    end = network.near.answer("a/**", answers)
    network.near.answer("b/**", lambda _: [Answer("b/1", b"z")])
    found = sorted(await network.ask("a/**"), key=lambda each: str(each.key_expr))
    told = [None if each.attachment is None else each.attachment.to_bytes() for each in found]
    assert [(str(each.key_expr), each.payload.to_bytes()) for each in found] == [
        ("a/1", b"x"), ("a/2", b"y"),
    ]  # fmt: skip
    assert told == [b"told", None]
    # More of them than wait at a time, so each one makes room for another.
    for _ in range(MOST_QUERIES + 1):
        assert await network.ask("a/bad") == []
    assert len(await network.ask("b/**")) == 1
    assert asked == ["a/**"] + ["a/bad"] * (MOST_QUERIES + 1)
    assert network.near.queries_refused == 0
    end()
    assert await network.ask("a/**") == []


async def test_so_many_queries_wait_and_more_are_told_so(network):
    await network.join()
    network.near.answer("a/**", lambda _: [Answer("a/1", b"x")])
    assert len(await network.ask("a/1")) == 1
    # The loop does not turn meanwhile, so none is answered.
    asked = [network.far.get("a/1", timeout=20) for _ in range(MOST_QUERIES + 3)]
    deadline = time.monotonic() + 10
    while network.near.queries_refused < 3 and time.monotonic() < deadline:
        time.sleep(0.01)  # noqa: ASYNC251
    assert network.near.queries_refused == 3
    replies = await asyncio.to_thread(lambda: [each for every in asked for each in every])
    assert sum(each.ok is not None for each in replies) == MOST_QUERIES
    refused = [each.err.payload.to_bytes() for each in replies if each.err is not None]
    assert refused == [b"too many queries; ask again later"] * 3
    assert len(await network.ask("a/1")) == 1


async def test_a_question_is_answered_later_or_dropped(network):
    await network.join()
    questions = []
    end = network.near.serve("a/set", questions.append)
    asking = asyncio.ensure_future(network.ask("a/set", b"body", b"told"))
    dropped = asyncio.ensure_future(network.ask("a/set"))
    await until(lambda: len(questions) == 2)
    with_body = [each for each in questions if each.payload]
    assert [each[:2] for each in with_body] == [(b"body", b"told")]
    for each in questions:
        if each.payload:
            each.reply(b"done", b"more")
        else:
            assert each.attachment is None
            each.drop()
    ((answer,), none) = await asyncio.gather(asking, dropped)
    assert (answer.payload.to_bytes(), answer.attachment.to_bytes()) == (b"done", b"more")
    assert (str(answer.key_expr), none) == ("a/set", [])
    end()


async def test_answers_of_others_come_without_their_errors(network):
    await network.join()

    def reply(query):
        if query.parameters:
            return
        query.reply("a/1", b"x", attachment=b"told")
        query.reply("a/2", b"y")
        query.reply_err(b"no")

    network.far.declare_queryable("a/**", reply)
    found = []
    async with asyncio.timeout(10):
        while not found:
            found = await network.near.get("a/**", 2.0)
    assert sorted(found) == [("a/1", b"x", b"told"), ("a/2", b"y", None)]
    waiting = []
    network.far.declare_queryable("b/**", waiting.append)
    began = time.monotonic()
    assert await network.near.get("b/1", 0.2) == []
    assert time.monotonic() - began < 8


async def test_puts_that_zenoh_refuses_are_counted_and_too_many_are_not_taken(network):
    for qos in ("urgent", "bulk"):
        assert network.near.put("a//b", b"", None, qos)
    await until(lambda: network.near.failed == 2)


async def test_samples_that_nobody_takes_in_time_are_dropped_and_others_have_their_turn(network):
    await network.join()
    near, came, turns = network.near, [], []
    near.subscribe("a", lambda each: came.append(each.payload))
    network.far.put("a", b"0")
    await until(lambda: len(came) == 1)
    for number in range(MOST_SAMPLES + 5):
        network.far.put("a", b"%d" % number, congestion_control=BLOCK)
    deadline = time.monotonic() + 20
    # The loop does not turn meanwhile.
    while near.overrun < 5 and time.monotonic() < deadline:
        time.sleep(0.01)  # noqa: ASYNC251
    assert near.overrun == 5
    while len(came) < 1 + MOST_SAMPLES:
        before = len(came)
        await asyncio.sleep(0)
        turns.append(len(came) - before)
    assert max(turns) <= AT_ONCE
    assert came[1:] == [b"%d" % number for number in range(MOST_SAMPLES)]
    network.far.put("a", b"last")
    await until(lambda: came[-1] == b"last")
    assert near.overrun == 5


async def test_what_was_put_leaves_before_the_session_closes(network):
    await network.join("mine/**")
    for number in range(200):
        network.near.put("mine/a", b"%d" % number, None, "bulk" if number % 2 else "urgent")
    await network.near.close()
    network.near = None
    await until(lambda: len(network.came) == 200)


async def test_where_zenoh_cannot_listen_the_user_is_told(network, tmp_path):
    params = FleetParams(name="mine", listen=[network.endpoint])
    with pytest.raises(UserError, match="Zenoh cannot be opened: "):
        await open_session(params, tmp_path)


async def test_a_router_that_is_away_is_said_once(tmp_path, caplog, monkeypatch):
    network, tries, opened = Network(), [], zenoh.open
    monkeypatch.setattr(zenoh, "open", lambda config: tries.append(1) or opened(config))
    params = FleetParams(name="mine", connect=[network.endpoint])
    opening = asyncio.ensure_future(open_session(params, tmp_path))
    await until(lambda: len(tries) == 3)
    assert not opening.done()
    assert caplog.text.count("no Zenoh router is reached") == 1
    await network.open(tmp_path)
    async with asyncio.timeout(20):
        opened = await opening
    await until(lambda: opened.is_reached)
    await opened.close()
    await network.close()


@pytest.mark.parametrize(
    ("params", "said"),
    [
        ({"down": ["cmd_vel"]}, '"tcp/localhost:7447" is open to everybody'),
        (
            {"down": ["cmd_vel"], "connect": ["tls/a:1"], "listen": ["tcp/b:2"]},
            'anybody may connect to "tcp/b:2"; use tls/ or quic/ endpoints where',
        ),
        ({"down": ["cmd_vel"], "listen": ["tls/b:2"]}, 'anybody may connect to "tls/b:2"'),
        ({"bridge": ["*"], "connect": ["tcp/a:1"]}, "bridge sends to robots what others put"),
        ({"zenoh": "absent.json5"}, r"fleet.zenoh: \S+/absent.json5: [^/]*\Z"),
    ],
)
def test_what_is_not_safe_or_not_there_is_refused(params, said, tmp_path):
    with pytest.raises(ConfigError, match=said):
        make_zenoh_config(FleetParams(**params), tmp_path)


def test_no_memory_is_shared(tmp_path):
    """A hardened service may not lock it; what a file of Zenoh says does not count."""
    (tmp_path / "zenoh.json5").write_text("{transport: {shared_memory: {enabled: true}}}")
    for file in ("", "zenoh.json5"):
        config = make_zenoh_config(FleetParams(name="mine", zenoh=file), tmp_path)
        assert config.get_json("transport/shared_memory/enabled") == "false"


def test_certificates_at_both_ends_will_do(tmp_path):
    make_zenoh_config(FleetParams(down=["cmd_vel"], connect=["tls/a:1", "quic/b:2"]), tmp_path)
    (tmp_path / "a.json5").write_text(zenoh_file(new_authority(), "a", 1))
    for protocol in ("tls", "quic"):
        params = FleetParams(down=["cmd_vel"], listen=[f"{protocol}/b:2"], zenoh="a.json5")
        make_zenoh_config(params, tmp_path)


def rules_for(subject, key="sdrlink/fleet/robot_$*/**", default="deny", messages=("put",)):
    """Rules of access control by which a subject may put at a key."""
    rule = {
        "id": "r", "permission": "allow", "flows": ["ingress"], "messages": list(messages),
        "key_exprs": [key],
    }  # fmt: skip
    return {
        "enabled": True, "default_permission": default, "rules": [rule],
        "subjects": [{"id": "s", **subject}], "policies": [{"rules": ["r"], "subjects": ["s"]}],
    }  # fmt: skip


NAMED = {"cert_common_names": ["desk"]}


@pytest.mark.parametrize(
    ("rules", "fault"),
    [
        (rules_for(NAMED), ""), (rules_for({"usernames": ["ann"]}), ""),
        (rules_for({}, "sdrlink/fleet/@gw/**"), ""), (rules_for({}, "sdrlink/other/**"), ""),
        (rules_for({}, messages=["declare_subscriber"]), ""),
        (rules_for({}, "42/**", messages=["declare_subscriber"]), ""),
        (rules_for({}, "42/robot_2/**"), "lets subject 's' command at 42/"),
        (rules_for({}, "42/**", messages=["query"]), "lets subject 's' command at 42/"),
        (rules_for({}, "sdrlink/**", messages=["query"]), ""),
        (rules_for(NAMED, default="allow"), "has default_permission 'allow'; allowed: \"deny\""),
        (rules_for({}), "lets subject 's' command at sdrlink/fleet/robot_"),
        (rules_for({"interfaces": ["eth0"]}, "**"), "who may be anybody; allowed: subjects with"),
        (rules_for({"zids": ["ab"]}, "sdrlink/fleet/robot_2/cmd_vel"), "who may be anybody"),
        (rules_for({"link_protocols": ["tls"]}, "sdrlink/*/robot_2/**"), "who may be anybody"),
        (
            {"enabled": True, "default_permission": "allow", "rules": [], "subjects": [],
             "policies": []}, "has default_permission 'allow'",
        ),
    ],
)  # fmt: skip
def test_rules_of_access_control_are_read(rules, fault, tmp_path):
    (tmp_path / "acl.json5").write_text(json.dumps({"access_control": rules}))
    params = FleetParams(down=["cmd_vel"], listen=["tcp/a:1"], zenoh="acl.json5", ros_domain=42)
    if not fault:
        make_zenoh_config(params, tmp_path)
        return
    with pytest.raises(ConfigError, match=f"fleet.down sends .* access_control .*{fault}"):
        make_zenoh_config(params, tmp_path)


@pytest.mark.parametrize(
    ("file", "mode", "connect"),
    [
        ("{access_control: {enabled: true}}", "client", ["tcp/localhost:7447"]),
        ('{mode: "router"}', "router", []),
        ('{mode: "client", connect: {endpoints: ["tcp/a:1"]}}', "client", ["tcp/a:1"]),
    ],
)
def test_a_file_of_zenoh_counts_where_it_says_whom_to_connect_to(file, mode, connect, tmp_path):
    (tmp_path / "zenoh.json5").write_text(file)
    config = make_zenoh_config(FleetParams(zenoh="zenoh.json5"), tmp_path)
    assert json.loads(config.get_json("mode")) == mode
    assert json.loads(config.get_json("connect/endpoints")) == connect
    multicast = json.loads(config.get_json("scouting/multicast/enabled"))
    assert multicast is (False if file.startswith("{access") else None)


@pytest.mark.parametrize(
    ("given", "mode", "connect", "listen"),
    [
        ({}, "client", ["tcp/localhost:7447"], []),
        ({"connect": ["tcp/a:1"]}, "client", ["tcp/a:1"], []),
        ({"listen": ["tcp/b:2"]}, "router", [], ["tcp/b:2"]),
        ({"connect": ["tcp/a:1"], "listen": ["tcp/b:2"]}, "router", ["tcp/a:1"], ["tcp/b:2"]),
    ],
)
def test_who_is_connected_to_and_who_is_listened_for(given, mode, connect, listen, tmp_path):
    (tmp_path / "peer.json5").write_text('{mode: "peer", connect: {endpoints: ["tcp/c:3"]}}')
    for file in ("", "peer.json5") if given else ("",):
        config = make_zenoh_config(FleetParams(**given, zenoh=file), tmp_path)

        def told(key, config=config):
            return json.loads(config.get_json(key))

        assert (told("mode"), told("connect/endpoints"), told("listen/endpoints")) == (
            mode, connect, listen,
        )  # fmt: skip
        assert told("scouting/multicast/enabled") is False
        # A thread that waits in Zenoh cannot be stopped.
        assert told("connect/timeout_ms") == 0
        assert told("connect/retry")["period_init_ms"] == 100
        assert not told("timestamping/enabled")
    config = make_zenoh_config(FleetParams(**given, ros_domain=0), tmp_path)
    assert json.loads(config.get_json("timestamping/enabled")) is True


ASKS = 'transport: {link: {tls: {enable_mtls: true, root_ca_certificate: "ca.pem"}}}'


@pytest.mark.parametrize(
    ("file", "open_one"),
    [
        ("{listen: {endpoints: []}}", "…"),
        ('{listen: {endpoints: {peer: ["tls/a:1"], router: ["tcp/b:2"]}}}', "tcp/b:2"),
        ('{listen: {endpoints: {peer: ["tls/a:1"]}}}', "tls/a:1"),
        (f'{{listen: {{endpoints: {{peer: ["tls/a:1"]}}}}, {ASKS}}}', ""),
        ('{listen: {endpoints: []}, connect: {endpoints: ["udp/a:1"]}}', "udp/a:1"),
    ],
)  # fmt: skip
def test_every_endpoint_in_a_file_of_zenoh_has_to_be_safe(file, open_one, tmp_path):
    (tmp_path / "zenoh.json5").write_text(file)
    params = FleetParams(zenoh="zenoh.json5", bridge=["odom"])
    if not open_one:
        make_zenoh_config(params, tmp_path)
        return
    with pytest.raises(
        ConfigError, match=f'fleet.bridge sends .*"{open_one}"( is open to|; use tls/)'
    ):
        make_zenoh_config(params, tmp_path)
