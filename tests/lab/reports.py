"""Reports of invented runs."""

from sdrlinkd.lab import LabReport, PairResult, RobotResult


def robot(robot_id: int, **given: object) -> RobotResult:
    """A robot without events."""
    figures = {
        "carrier": "QPSK 3/4", "access": "tdma: 2 slots", "airtime_share": 0.1,
        "bursts_by_mcs": {2: 30}, "mcs_changes": [], "snr_db": {}, "bursts_sent": 30,
        "bursts_failed": 0, "bursts_late": 0, "pdus_sent": 30, "pdus_heard": 30, "pdus_bad": 0,
        "headers_bad": 0, "samples_lost": 0, "hub_outages": 0, "dropped": {}, "left": 0,
        "ledger_adds_up": True,
    }  # fmt: skip
    return RobotResult(**{**figures, "id": robot_id, **given})


def pair(sender: int, receiver: int, **given: object) -> PairResult:
    """A direction in which everything arrived."""
    figures = {
        "sent": 30, "received": 30, "pdr": 1.0, "pdr_tenths": [1.0] * 10,
        "latency_ms": {"p50": 20.0, "p90": 25.0, "p99": 30.0, "max": 31.0},
        "bytes_identical": True, "topics": {"cmd_vel": [30, 30]},
    }  # fmt: skip
    return PairResult(**{**figures, "sender": sender, "receiver": receiver, **given})


def lost(sender: int, receiver: int) -> PairResult:
    """A direction in which nothing of the second half arrived."""
    tenths = [None] * 5 + [0.0] * 5
    return pair(
        sender, receiver, received=0, pdr=0.0, pdr_tenths=tenths, latency_ms={},
        topics={"cmd_vel": [30, 0]},
    )  # fmt: skip


def report(**given: object) -> LabReport:
    """A report of two robots, between which everything arrived."""
    figures = {
        "scenario": "small", "title": "Two small robots", "pace": "lockstep", "seed": 1,
        "duration_s": 3.0, "source": "built-in robot", "pdr": 1.0, "worst_pdr": 1.0,
        "robots": [robot(1), robot(2)], "pairs": [pair(1, 2), pair(2, 1)], "out_of_reach": [],
        "damage": "",
    }  # fmt: skip
    return LabReport(**{**figures, **given})
