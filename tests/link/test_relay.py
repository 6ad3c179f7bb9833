"""PDUs for others: forwarded by route or flood, once, never back, with their ages."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.errors import ConfigError
from sdrlinkd.link import (
    FixedRoutes,
    Outcome,
    Overrides,
    Qos,
    QueueParams,
    RelayParams,
    TopicPolicy,
)
from sdrlinkd.wire import parse
from tests.laws import law
from tests.link.world import compose, make_link, rx, send_all, tx

HOPS = 3


def node(own_id, *routes, policy="routes", **more):
    relay = (
        RelayParams(policy=policy, routes=list(routes)) if routes or policy != "routes" else None
    )
    return make_link(own_id, pdu_size=64, hop_limit=HOPS, relay=relay, seed=own_id, **more)


def pass_on(link, now):
    """What a link sends at `now`."""
    pdus = []
    while burst := compose(link, now, 8):
        link.confirm(burst, Outcome.SENT, now)
        pdus += burst.pdus
    return pdus


def test_a_message_crosses_a_chain_and_its_age_adds_up():
    one, two, three, four = node(1), node(2, "1>4"), node(3, "1>4"), node(4)
    one.submit(0, bytes(120), 0.0, Overrides(dst=4))
    now, pdus = 0.01, pass_on(one, 0.01)
    for relay in (two, three):
        for pdu in pdus:
            assert relay.hear(pdu, now) == []
        now += 0.1
        pdus = pass_on(relay, now)
    (message,) = [message for pdu in pdus for message in four.hear(pdu, now + 1000)]
    assert message.payload == bytes(120)
    assert now + 1000 - message.origin_at == pytest.approx(0.21, abs=2e-6)
    assert message.hops_left == HOPS - 2
    assert rx(two).pdus_dropped["rx_relayed"] == rx(three).pdus_dropped["rx_relayed"] == 3
    assert two.audit() == three.audit() == four.audit() == []


@pytest.mark.parametrize(("deadman_s", "arrives"), [(0.0, True), (1.0, False)])
def test_what_has_begun_in_time_crosses_a_chain_after_its_lifespan_except_commands(
    deadman_s, arrives
):
    one, two, three = node(1), node(2, "1>3"), node(3)
    for link in (one, two, three):
        link.set_policies({0: TopicPolicy(lifespan_s=0.2, deadman_s=deadman_s)})
    one.submit(0, bytes(200), 0.0, Overrides(dst=3))
    heard = []
    for now in (0.05, 0.15, 0.25, 0.35, 0.45):
        if burst := compose(one, now, 1):
            one.confirm(burst, Outcome.SENT, now)
            for pdu in burst.pdus:
                assert two.hear(pdu, now) == []
        for pdu in pass_on(two, now + 0.01):
            heard += three.hear(pdu, now + 0.02)
    assert [message.payload for message in heard] == [bytes(200)] * arrives
    assert one.audit() == two.audit() == three.audit() == []


def test_what_a_relay_sends_on_is_known_to_who_heard_it_before():
    """STAMPs grow on the way; duplicates are recognised by the constant parts."""
    one, two, three = node(1), node(2, "any>all"), node(3)
    one.submit(0, b"\0\1\0\0message", 0.0)
    (pdu,) = pass_on(one, 0.0)
    two.hear(pdu, 0.0)
    (again,) = pass_on(two, 0.3)
    assert again != pdu
    assert len(three.hear(pdu, 0.0)) == 1
    assert three.hear(again, 0.3) == []
    assert rx(three).pdus_dropped["rx_dup"] == 1
    assert one.hear(again, 0.3) == []
    assert rx(one).pdus_dropped["rx_own"] == 1


@pytest.mark.parametrize(
    ("routes", "src", "dst", "goes"),
    [
        (["1>3"], 1, 3, True), (["1>3"], 3, 1, False), (["1>3"], 1, 255, False),
        (["any>3"], 7, 3, True), (["1>any"], 1, 9, True), (["1>any"], 2, 9, False),
        (["1>all"], 1, 255, True), (["any>any"], 5, 6, True), ([], 1, 3, False),
        (["any>any"], 1, 2, False), (["any>any"], 1, 1, False),
    ],
)  # fmt: skip
def test_routes(routes, src, dst, goes):
    sender, relay = node(src), node(2, *routes)
    sender.submit(0, bytes(8), 0.0, Overrides(dst=dst))
    (pdu,) = pass_on(sender, 0.0)
    relay.hear(pdu, 0.0)
    assert [parse(each, 64).src for each in pass_on(relay, 0.1)] == [src] * goes


@pytest.mark.parametrize("text", ["1-3", "1>", ">3", "1>256", "255>1", "all>3", "1>everyone", ""])
def test_a_route_that_cannot_be_read_is_refused(text):
    with pytest.raises(ConfigError, match="allowed: FROM>TO"):
        FixedRoutes(RelayParams(policy="routes", routes=[text]))


def test_hops_end():
    one, relays = node(1), [node(i, policy="flood") for i in (2, 3, 4, 5)]
    one.submit(0, bytes(8), 0.0)
    pdus, counts = pass_on(one, 0.0), []
    for relay in relays:
        for pdu in pdus:
            relay.hear(pdu, 0.0)
        pdus = pass_on(relay, 0.0)
        counts.append(len(pdus))
    assert counts == [1, 1, 0, 0]


def test_relayed_pdus_go_by_class_and_priority_and_never_mix_in_a_burst():
    one, two = node(1), node(2, "1>3")
    two.set_policies({1: TopicPolicy(priority=99)})
    for topic, qos in ((0, Qos.BULK), (1, Qos.BULK), (2, Qos.LATENCY)):
        one.submit(topic, bytes(30), 0.0, Overrides(qos, dst=3))
    for pdu in pass_on(one, 0.0):
        two.hear(pdu, 0.0)
    two.submit(0, bytes(30), 0.0, Overrides(Qos.LATENCY, priority=0))
    two.submit(0, bytes(30), 0.0, Overrides(Qos.URGENT))
    bursts = []
    while burst := compose(two, 0.1, 8):
        two.confirm(burst, Outcome.SENT, 0.1)
        bursts.append([(parse(pdu, 64).src, parse(pdu, 64).qos) for pdu in burst.pdus])
    assert all(len({src for src, _ in burst}) == 1 for burst in bursts)
    assert [burst[0][0] for burst in bursts] == [2, 1, 2, 1]


def test_a_relay_that_is_never_idle_still_tells_of_itself():
    """What it forwards is more urgent than its beacons, and no burst holds both."""
    one, two = node(1), node(2, "1>3", beacon_s=0.5)
    sources = []
    for i in range(300):
        now = 0.01 * i
        one.submit(2, bytes(30), now, Overrides(Qos.URGENT, dst=3))
        for pdu in pass_on(one, now):
            two.hear(pdu, now)
        burst = compose(two, now, 4)
        two.confirm(burst, Outcome.SENT, now)
        sources += [parse(pdu, 64).src for pdu in burst.pdus]
    assert 3 <= sources.count(2) <= 12
    assert sources.count(1) > 250


def test_a_relay_does_not_keep_what_is_old():
    one, two = node(1), node(2, "1>3")
    one.submit(0, bytes(8), 0.0, Overrides(dst=3))
    (pdu,) = pass_on(one, 0.0)
    two.hear(pdu, 0.0)
    assert pass_on(two, 1.5) == []
    assert two.report(0.0).relayed.dropped["tx_expired"] == 1
    assert two.audit() == []


@pytest.mark.slow
@law(30)
@given(st.integers(0, 2**32))
def test_in_any_mesh_messages_arrive_once_and_the_ledgers_add_up(seed):
    """Flooding over random links that lose a tenth; every robot sends to every other."""
    rng = Random(seed)
    nodes = {i: node(i, policy="flood") for i in range(1, 6)}
    links = {(a, b) for a in nodes for b in nodes if a != b and rng.random() < 0.5}
    got, on_air = {}, []
    for step in range(120):
        now = step * 0.01
        for i, link in nodes.items():
            if rng.random() < 0.2 and step < 60:
                payload = (
                    bytes((0, 1, 0, 0, i)) + step.to_bytes(2, "big") + bytes(rng.randrange(90))
                )
                link.submit(rng.randrange(3), payload, now, Overrides(dst=rng.choice((None, 3))))
            if rng.random() < 0.5 and (burst := compose(link, now, 4)):
                link.confirm(burst, rng.choice((Outcome.SENT, Outcome.SENT, Outcome.LOST)), now)
                on_air += [(b, pdu) for a, b in links if a == i for pdu in burst.pdus]
        rng.shuffle(on_air)
        while on_air:
            b, pdu = on_air.pop()
            if rng.random() < 0.9:
                for message in nodes[b].hear(pdu, now):
                    assert message.src != b, f"seed {seed}"
                    key = (b, message.src, message.payload[5:7])
                    got[key] = got.get(key, 0) + 1
        for link in nodes.values():
            link.handle_timers(now)
            assert link.audit() == [], f"seed {seed}"
    assert max(got.values(), default=1) == 1, f"seed {seed}: delivered twice"
    assert len(got) > 10 or len(links) < 6, f"seed {seed}: positive control"


def test_the_list_of_what_is_relayed_is_bounded_by_the_queue():
    two = node(2, "1>3")
    one = node(1)
    for i in range(400):
        one.submit(0, bytes(30), i * 0.01, Overrides(dst=3))
        for pdu in send_all(one, i * 0.01):
            two.hear(pdu, 0.0)
    tally = two.report(0.0).relayed
    assert tally.accepted == 400 == tx(two).queued


def test_a_pdu_that_the_full_queue_does_not_take_is_not_counted_as_forwarded():
    """The queue holds one message, and that one is more urgent."""
    sender = make_link(1, hop_limit=2)
    relay = make_link(
        2, hop_limit=2, relay=RelayParams(policy="flood"), queue=QueueParams(max_messages=1)
    )
    relay.submit(0, bytes(9), 0.0, Overrides(qos=Qos.URGENT))
    sender.submit(0, bytes(9), 0.0, Overrides(dst=3))
    for pdu in compose(sender, 0.0).pdus:
        relay.hear(pdu, 0.1)
    assert rx(relay).pdus_dropped == {"rx_not_for_us": 1}
    assert relay.report(0.0).relayed.dropped == {"tx_overflow_new": 1}
    assert relay.audit() == []
