"""Links with parity for bulk messages, and images sent over them."""

from sdrlinkd.link import ClassesParams, ClassParams, Outcome, Overrides, Qos
from tests.link.world import compose, make_link, rx


def protected(share, own_id=1, **more):
    """A link with that share of parity for bulk."""
    classes = ClassesParams(bulk=ClassParams(parity=share))
    return make_link(own_id, classes=classes, seed=own_id, **more)


def pdus_of(link, payload, now=0.0, topic=0):
    """The PDUs that carry a payload as bulk."""
    link.submit(topic, payload, now, Overrides(Qos.BULK))
    pdus = []
    while burst := compose(link, now):
        link.confirm(burst, Outcome.SENT, now)
        pdus += burst.pdus
    return pdus


def images_over(lost, share):
    """Number of 60 images that arrive if PDU i is lost where `lost[i]`; memory stays bounded."""
    sender, receiver = protected(share, pdu_size=1024), protected(0.0, 2, pdu_size=1024)
    at = got = 0
    for i in range(60):
        for pdu in pdus_of(sender, i.to_bytes(8, "big") + bytes(40_000), i * 0.3):
            if not lost[at % len(lost)]:
                got += len(receiver.hear(pdu, i * 0.3))
            at += 1
        receiver.handle_timers(i * 0.3)
        assert rx(receiver).held_bytes <= 1 << 20
        assert receiver.audit() == sender.audit() == []
    return got
