"""Robots that do not all hear each other."""

from sdrlinkd.link import RelayParams
from tests.link.lossy import Air

AUTO = RelayParams(policy="auto")


def both(*pairs):
    return {each for a, b in pairs for each in ((a, b), (b, a))}


def mesh(*pairs, **kinds):
    robots = sorted({robot for pair in pairs for robot in pair})
    kinds = {"relay": AUTO, "hop_limit": 6, **kinds}
    return Air(robots, hears=both(*pairs), **kinds)


def flows(air, robot):
    """Who forwards next, by source and destination."""
    report = air.links[robot].report(air.now).routes
    return {(flow.src, flow.dst): flow.forwarded_by for flow in report.flows if flow.forwarded_by}


def isolate(air, robot):
    """Let nobody hear a robot any more, nor the other way round."""
    air.hears = {pair for pair in air.hears if robot not in pair}


def of_others(air, robot):
    """The PDUs that a robot forwarded."""
    return [
        pdu for _, src, burst in air.bursts if src == robot for pdu in burst.pdus if pdu[1] != robot
    ]
