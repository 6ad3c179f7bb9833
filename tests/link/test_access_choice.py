"""The policies that a radio supports, with their times, and the message if it does not."""

from random import Random

import pytest

from sdrlinkd.errors import ConfigError
from sdrlinkd.link import AccessParams, PduLinkTraits, Qos, RateParams, Sensed, check_access
from sdrlinkd.link.access import (
    CLOCK_ERROR_S,
    LONGEST_APART_S,
    LONGEST_ROUND_S,
    MARGIN_S,
    Csma,
    Free,
    MiniSlots,
    Tdma,
    Wish,
    make_access,
)
from tests.link.radios import LOCKSTEP, PACED, params
from tests.link.slots import schedule_of
from tests.link.world import make_link

POLICIES = {"none": Free, "csma": Csma, "minislot": MiniSlots, "tdma": Tdma}
SHARED = ["csma", "minislot", "tdma"]
LONGEST_S = 0.004
DEAF = PduLinkTraits()
RECEIVER = LOCKSTEP._replace(kind="iqfile", transmits=False)
SLOW = PACED._replace(kind="usb", lead_s=0.5, react_s=0.2)


def make(wanted, own_id=1, traits=LOCKSTEP, longest_s=LONGEST_S):
    return make_access(wanted, own_id, traits, longest_s, Random(1))


def refusal(*arguments, **more):
    with pytest.raises(ConfigError) as error:
        make(*arguments, **more)
    message = str(error.value)
    assert "\n" not in message
    return message


@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize("traits", [LOCKSTEP, PACED], ids=["lockstep", "paced"])
def test_each_policy_by_its_name(policy, traits):
    access = make(params(policy, [3, 1]), traits=traits)
    assert isinstance(access, POLICIES[policy])
    assert access.state.startswith(policy)
    assert access.notices(1.0) == []
    assert (access.round_s > 0) == (policy in ("minislot", "tdma"))


def test_none_needs_nothing():
    assert isinstance(make(params("none", []), traits=DEAF), Free)
    assert isinstance(make(params("none", []), traits=RECEIVER), Free)


@pytest.mark.parametrize("policy", SHARED)
@pytest.mark.parametrize(
    ("traits", "why"),
    [
        (DEAF, 'the backend "direct" does not sense the channel'),
        (LOCKSTEP._replace(senses=False), 'the backend "ether" does not sense the channel'),
    ],
)
def test_a_radio_that_cannot_listen_and_talk_is_refused(policy, traits, why):
    message = refusal(params(policy, [1, 2]), traits=traits)
    assert message == f'access.policy: got "{policy}", but {why}; allowed: "none"'


@pytest.mark.parametrize("policy", ["minislot", "tdma"])
@pytest.mark.parametrize(
    ("nodes", "parts"),
    [
        ([2, 3], ["got [2, 3]", f"allowed with access.policy = {'{policy}'}", "this robot's 1"]),
        ([], ["got []", "this robot's 1 among them", "in the same order"]),
        ([1, 2, 2], ["got [1, 2, 2]", "allowed: each robot once"]),
    ],
)
def test_the_robots_are_each_named_once_and_we_are_one_of_them(policy, nodes, parts):
    wanted = params(policy, nodes)
    message = refusal(wanted)
    assert message.startswith("access.nodes: got [")
    for part in parts:
        assert part.format(policy=f'"{policy}"') in message
    with pytest.raises(ConfigError) as error:
        check_access(wanted, 1)
    assert str(error.value) == message, "it can be told without a radio"


def test_csma_need_not_know_who_there_is():
    check_access(params("csma", []), 1)
    make(params("csma", [2, 2]))


def test_too_short_a_minislot_is_refused_with_what_the_radio_needs():
    least_s = make(params("minislot", [1, 2]), traits=PACED).minislot_s
    assert least_s >= PACED.lead_s + PACED.react_s + PACED.detect_s
    make(params("minislot", [1, 2], minislot_s=least_s), traits=PACED)
    message = refusal(params("minislot", [1, 2], minislot_s=0.9 * least_s), traits=PACED)
    assert message.startswith(f"access.minislot_s: got {0.9 * least_s:g}; ")
    for part in ("ether: turnaround 0.05 ms, lead 3.05 ms, reaction 3 ms", f"{least_s:.4g} s",
                 "allowed: that or more at all robots, or 0 (derived from the radio)"):  # fmt: skip
        assert part in message


def test_too_short_a_guard_is_refused_with_what_the_radio_needs():
    traits = LOCKSTEP._replace(turnaround_s=300e-6, index_error_s=20e-6)
    made_s = make(params("tdma", [1]), traits=traits).guard_s
    assert made_s >= 300e-6 + 40e-6 + MARGIN_S
    make(params("tdma", [1], guard_s=350e-6), traits=traits)
    message = refusal(params("tdma", [1], guard_s=300e-6), traits=traits)
    assert message.startswith("access.guard_s: got 0.0003; this radio (ether: turnaround 0.3 ms")
    assert "needs at least 0.000345 s; allowed: that or more" in message


def test_too_short_a_slot_is_refused_with_the_longest_burst():
    message = refusal(params("tdma", [1], slot_s=0.003, guard_s=0.001))
    assert message.startswith("access.slot_s: got 0.003; allowed: at least 0.005")
    for part in ("room for the longest burst", "and a guard of 1 ms"):
        assert part in message
    least_s = float(message.split("at least ")[1].split(" s")[0])
    for slot_s in (1.001 * least_s, 0.5):
        assert make(params("tdma", [1], slot_s=slot_s, guard_s=0.001)).round_s == slot_s


def test_too_long_a_round_is_refused_and_tdma_named_instead():
    """The radio needs 90 ms for each of four robots in three sections."""
    late = SLOW._replace(lead_s=0.05, react_s=0.04)
    message = refusal(params("minislot", [1, 2, 3, 4]), traits=late)
    assert message.startswith('access.policy: got "minislot"; with 4 robots and a radio that needs')
    for part in ("90 ms for each", "a round takes 1.08 s", "allowed: at most 1 s: use tdma, or"):
        assert part in message
    many = list(range(255))
    assert "with 255 robots" in refusal(params("minislot", many), traits=PACED)
    few = make(params("minislot", many[:54]), traits=PACED)
    assert 0.9 * LONGEST_ROUND_S < few.round_s <= LONGEST_ROUND_S
    make(params("tdma", many), traits=PACED)


@pytest.mark.parametrize("policy", ["csma", "minislot"])
def test_who_is_heard_too_late_is_refused_and_tdma_named_instead(policy):
    for wanted in (params(policy, [1, 2]), params(policy, [1, 2], slottime_s=0.01)):
        message = refusal(wanted, traits=SLOW)
        assert message.startswith(f'access.policy: got "{policy}"; this radio detects')
        for part in ("bursts only after 700 ms", "allowed: at most 100 ms: use tdma"):
            assert part in message
    access = make(params(policy, [1, 2]), traits=SLOW._replace(lead_s=0.05, react_s=0.04))
    apart_s = access.slottime_s if policy == "csma" else access.minislot_s
    assert 0.9 * LONGEST_APART_S < apart_s <= LONGEST_APART_S
    make(params("tdma", [1, 2]), traits=SLOW)


@pytest.mark.parametrize(("turnaround_s", "is_told"), [(0.0, False), (3e-4, False), (0.08, True)])
def test_without_turns_a_radio_that_turns_round_slowly_is_told_of(turnaround_s, is_told):
    free = make(params("none", []), traits=LOCKSTEP._replace(turnaround_s=turnaround_s))
    assert bool(free.notices(1.0)) == is_told
    if is_told:
        assert "hears nothing for 160 ms" in free.notices(1.0)[0]
        assert 'access.policy = "tdma"' in free.notices(1.0)[0]


def test_a_slot_that_is_over_before_it_is_known_to_be_unused_is_not_reused():
    """Its owner may then begin late in it, so nobody relies on hearing the owner by then."""
    never = make(params("tdma", [1, 2], minislot_s=0.1, slot_s=0.02))
    assert not never.step_s
    slots = [never.slot(Wish(1e-3 * i, Qos.BULK, 0.001, Sensed())) for i in range(600)]
    begun = [slot for slot in slots if slot is not None]
    assert {round(max(0.0, slot.late_end - 0.001 - slot.start), 3) for slot in begun} >= {
        0.001,
        0.005,
        0.015,
    }


def test_minislots_too_short_to_hear_each_other_are_not_reused_in_tdma():
    """They are never refused: without reuse they are not needed."""
    tight = make(params("tdma", [1, 2], minislot_s=1e-4))
    wide = make(params("tdma", [1, 2], minislot_s=0.01, slot_s=0.02))
    assert (bool(tight.step_s), bool(wide.step_s)) == (False, True)
    without = make(params("tdma", [1, 2], reuse=False))
    assert schedule_of(without) == schedule_of(tight)


@pytest.mark.parametrize("policy", ["minislot", "csma", "tdma"])
@pytest.mark.parametrize("traits", [LOCKSTEP, PACED], ids=["lockstep", "paced"])
def test_who_began_a_slot_earlier_a_kilometre_away_is_heard_in_time(policy, traits):
    """A burst is decided when one begun a slot earlier has been on the air long enough here."""
    wanted = params(policy, [2, 1], persist=1.0, slot_s=0.2)
    access = make(wanted, traits=traits)
    # With tdma, it begins the schedule itself, with the slot of robot 2, which is silent.
    if policy != "tdma":
        access.heard(2, 9.9, False)
    apart_s = access.slottime_s if policy == "csma" else access.minislot_s
    step_s = 1e-6
    for step in range(int(0.1 / step_s)):
        until = 10.0 + step * step_s
        sensed = Sensed(until, 10.0 - 1e-9, 9.9)
        slot = access.slot(Wish(until + traits.lead_s, Qos.URGENT, 0.001, sensed))
        if slot is not None:
            break
    heard_s = traits.detect_s + MARGIN_S
    if policy == "tdma":
        # Here each counts from its own clock.
        heard_s += CLOCK_ERROR_S
    assert slot.start - apart_s + heard_s <= until + 2 * step_s


def test_the_longest_burst_is_that_of_any_mcs_in_use():
    traits = LOCKSTEP._replace(longest_burst_s=(0.02, 0.01, 0.005), needed_snr_db=(1, 4, 8), mcs=2)
    lengths = {}
    for name, rate in {
        "fixed": RateParams(),
        "any": RateParams(adapt=True),
        "upper": RateParams(adapt=True, min_mcs=1),
    }.items():
        link = make_link(1)
        fit = link.attach(traits, params("tdma", [1, 2]), rate)
        lengths[name] = fit.settled.access.round_s
    assert lengths["fixed"] < lengths["upper"] < lengths["any"]
    assert lengths["any"] > 2 * 0.02


def test_a_link_without_an_air_to_share_sends_at_any_time():
    link = make_link(1)
    assert isinstance(link.attach(DEAF, AccessParams(), RateParams()).settled.access, Free)
    with pytest.raises(ConfigError, match=r"access\.policy"):
        link.attach(DEAF, params("csma", []), RateParams())
