"""Services and actions of real ROS 2 nodes over air that loses a fifth of the bursts, and fails."""

import pytest

from tests.laws import often
from tests.ros.programs import Agent
from tests.ros.rough_air import air, hub, world
from tests.ros.team import WAIT_S, Robot, config
from tests.waiting import wait_for

__all__ = ["air", "hub", "world"]

pytestmark = pytest.mark.realtime(most_s=20)

ALLOW = ("-p", 'services.allow:=["/set", "/fibonacci"]')
SUCCEEDED, CANCELED = 4, 5
N_CALLS = often(200)


@pytest.fixture
def robots(start_daemon, start, hub):
    one = Robot(start, start_daemon(config(hub, 1)), *ALLOW).bridged()
    two = Robot(start, start_daemon(config(hub, 2))).bridged()
    return one, two


def test_calls_over_a_link_that_loses_a_fifth_are_each_executed_once(robots, air):
    one, two = robots
    one.node.serve(name="/set")
    wait_for(lambda: two.node.is_served(name="/robot_1/set"), WAIT_S)
    air.loss = 0.2
    answers = two.node.call(name="/robot_1/set", n=N_CALLS, at_once=4)
    assert [each[0] for each in answers] == [i % 2 == 0 for i in range(N_CALLS)]
    assert one.node.n_served() == N_CALLS
    assert sorted(each[1] for each in answers) == sorted(f"call {i + 1}" for i in range(N_CALLS)), (
        "each answer is of another call"
    )


@pytest.mark.long
def test_calls_in_an_outage_are_executed_once_or_not_at_all(robots, air):
    one, two = robots
    one.node.serve(name="/set")
    wait_for(lambda: two.node.is_served(name="/robot_1/set"), WAIT_S)
    two.node.call(name="/robot_1/set", n=1)
    air.loss = 0.3
    two.node.call_later(name="/robot_1/set", n=20, hz=4.0)
    wait_for(lambda: one.node.n_served() >= 4, WAIT_S)
    air.is_cut = True
    two.node.wait(seconds=5.0)
    air.is_cut = False
    answers = two.node.called()
    told = [each[1] for each in answers if each is not None]
    assert len(set(told)) == len(told), "no call has another's answer"
    assert len(told) <= one.node.n_served() - 1 <= 20, "none was executed twice"
    assert len(told) >= 4
    if None in answers:
        # What has no answer is in the log, with the reason.
        two.bridge.says("/set of robot 1: no answer came in time")


@pytest.mark.long
def test_an_action_survives_an_outage_in_its_middle_and_can_be_cancelled(robots, air):
    one, two = robots
    one.node.act(name="/fibonacci", step_s=1.0)
    wait_for(lambda: two.node.is_served(name="/robot_1/fibonacci/_action/get_result"), WAIT_S)
    # Its goal takes 30 s.
    assert two.node.send_goal(name="/robot_1/fibonacci", order=32)
    wait_for(lambda: two.node.n_feedback() > 8, WAIT_S)
    air.is_cut = True
    two.node.wait(seconds=8.0)
    air.is_cut = False
    wait_for(lambda: two.node.result_of_goal() is not None, WAIT_S)
    numbers = [0, 1]
    while len(numbers) < 32:
        numbers.append(numbers[-1] + numbers[-2])
    assert two.node.result_of_goal() == [SUCCEEDED, numbers]
    assert two.node.send_goal(name="/robot_1/fibonacci", order=40)
    wait_for(lambda: two.node.n_feedback() > 2, WAIT_S)
    assert two.node.cancel_goal() == 1
    wait_for(lambda: two.node.result_of_goal() is not None, WAIT_S)
    status, sequence = two.node.result_of_goal()
    assert status == CANCELED
    assert sequence == numbers[: len(sequence)]
    assert one.node.n_goals() == 2, "no goal was sent twice"
    # Cancelled while nothing arrives, for longer than any other call takes.
    assert two.node.send_goal(name="/robot_1/fibonacci", order=400)
    wait_for(lambda: two.node.n_feedback() > 2, WAIT_S)
    air.is_cut = True
    two.node.wait(seconds=5.0)
    two.node.begin_to_cancel()
    two.node.wait(seconds=9.0)
    assert two.node.cancelled() is None
    air.is_cut = False
    wait_for(lambda: two.node.cancelled() == 1, WAIT_S)
    wait_for(lambda: two.node.result_of_goal() is not None, WAIT_S)
    assert two.node.result_of_goal()[0] == CANCELED


@pytest.mark.long
def test_what_cannot_be_called_is_said_and_ends_no_other(robots, start):
    one, two = robots
    one.node.serve(name="/set")
    one.node.serve(name="/unlisted")
    wait_for(lambda: two.node.is_served(name="/robot_1/set"), WAIT_S)
    assert not two.node.is_served(name="/robot_1/unlisted")
    other = start(Agent, one.domain, "other")
    other.serve(name="/set")
    one.bridge.says("/set: /node and /other both offer it; stop one of them")
    wait_for(lambda: not two.node.is_served(name="/robot_1/set"), WAIT_S)
    other.end()
    # DDS notices the end of a process after a while; then the service is offered again.
    wait_for(lambda: two.node.is_served(name="/robot_1/set"), WAIT_S)
    assert two.node.call(name="/robot_1/set", n=1)[0][0] is True
    one.bridge.kill()
    one.daemon.stop()
    wait_for(lambda: not two.node.is_served(name="/robot_1/set"), WAIT_S)
