"""Schedules of the policy `grant`."""

from functools import cache

from tests.link.turns import Team

FORMED_S = 3.0


@cache
def schedule_of(nodes):
    """What identifies the schedule of these robots, as their plans tell it."""
    team = Team(list(nodes), 1)
    team.run(FORMED_S)
    return team.schedule
