"""A receiver that must not receive anything."""

from time import process_time

from phy import Receiver
from tests.phy.signals import heard


def quiet(samples, network, max_frequency=0.1):
    """Assert that a receiver hears no PDU in `samples` and works little; returns its counters."""
    receiver = Receiver(network, max_frequency)
    begin = process_time()
    assert heard(receiver.push(samples) + receiver.flush()) == []
    assert process_time() - begin < 1 + 5e-6 * len(samples)
    return receiver.counters
