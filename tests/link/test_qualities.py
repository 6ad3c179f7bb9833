"""How well a robot says that it hears another one, after a pause."""

import pytest

from sdrlinkd.link import ClockParams, PduLinkTraits
from tests.link.meshes import isolate, mesh


def share(air, robot, of):
    """What arrives at a robot of what another one sends, by its report."""
    return next(
        each.hears[of] for each in air.links[robot].report(air.now).routes.robots
        if each.id == robot
    )  # fmt: skip


def flow(air, src, s):
    every_s = 0.02
    air.flow(src, round(s / every_s), every_s=every_s)


@pytest.mark.slow
@pytest.mark.parametrize(("needed_db", "least", "most"), [(16.0, 0.9, 1.0), (16.5, 0.0, 0.7)])
def test_what_is_missed_while_a_robot_is_away_counts_at_the_edge_of_range_only(
    needed_db, least, most
):
    """Elsewhere it comes back as well as it went, and must not pass for one that hears poorly."""
    traits = PduLinkTraits(needed_snr_db=(needed_db,))
    air = mesh((1, 2), (1, 3), (2, 3), traits=traits)
    flow(air, 2, 3.0)
    hears = set(air.hears)
    isolate(air, 1)
    flow(air, 2, 3.0)
    air.hears = hears
    flow(air, 2, 0.7)
    assert least < share(air, 1, of=2) <= most


@pytest.mark.slow
def test_what_came_through_a_relay_only_was_lost_on_the_link():
    air = mesh((1, 2), (1, 3), (2, 3))
    flow(air, 2, 3.0)
    air.hears -= {(1, 2)}
    flow(air, 2, 3.0)
    air.hears |= {(1, 2)}
    flow(air, 2, 0.7)
    assert share(air, 1, of=2) < 0.7
    flow(air, 2, 5.0)
    assert share(air, 1, of=2) > 0.8


@pytest.mark.slow
def test_lost_pdus_count_however_rarely_a_robot_is_heard():
    """Of a robot that says something once a second, every other PDU comes."""
    quiet = ClockParams(period_s=0.0)
    air = mesh((1, 2), lost=lambda to, _src, n, _pdu: to == 1 and n % 2, clock=quiet)
    air.run(40.0)
    assert share(air, 1, of=2) < 0.85
