"""How long a robot's usual pauses are, and what is an outage."""

from sdrlinkd.link.receive import LONGEST_GAP_S, Neighbor


def heard(neighbor, times):
    for at in times:
        neighbor.heard_at(at)
    return neighbor.usual_gap_s


def test_the_usual_pause_is_the_longest_of_the_latest():
    neighbor = Neighbor(2)
    assert heard(neighbor, [1.0]) == 0.0
    assert heard(neighbor, [2.0, 5.0, 5.5]) > 2.9
    assert heard(neighbor, [5.5 + 0.1 * i for i in range(1, 300)]) < 0.2


def test_an_outage_is_no_usual_pause():
    """Otherwise the next outage would be noticed far too late."""
    neighbor = Neighbor(2)
    heard(neighbor, [float(second) for second in range(1, 60)])
    assert heard(neighbor, [400.0]) == LONGEST_GAP_S
    assert heard(neighbor, [400.0 + second for second in range(1, 120)]) < 3.0
