"""Links that run without a registry."""

from sdrlinkd.link import Outcome
from tests.link.world import compose, make_link


def auto(own_id=1, topics=(), **more):
    return make_link(own_id, topics=topics, has_numbers=True, seed=own_id, **more)


def step(links, now, lost=lambda: False):
    """All links send and hear at `now`; returns (to, from, name, payload)."""
    got = []
    for link in links:
        link.handle_timers(now)
        while burst := compose(link, now, 8):
            link.confirm(burst, Outcome.SENT, now)
            for pdu in burst.pdus:
                for other in links:
                    if other is not link and not lost():
                        got += [
                            (
                                other.own_id,
                                m.src,
                                other.heard_topic(m.src, m.series).name,
                                m.payload,
                            )
                            for m in other.hear(pdu, now)
                        ]
    return got


def run(links, begin, n, lost=lambda: False):
    return [each for i in range(n) for each in step(links, begin + 0.05 * i, lost)]
