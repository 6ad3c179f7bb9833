"""Any PDU, and a size that it fits."""

from hypothesis import strategies as st

from sdrlinkd.wire import Entry, Pdu, entry_budget

octet = st.integers(0, 255)


@st.composite
def sized_pdus(draw):
    """A valid PDU and a pdu_size it fits."""
    pdu_size = draw(st.sampled_from([32, 33, 220, 2047]) | st.integers(32, 2047))
    most = max(n for n in range(1, 16) if entry_budget(pdu_size, n) >= 5 * n)
    n = draw(st.integers(1, most))
    room = entry_budget(pdu_size, n) - 5 * n
    entries = []
    for _ in range(n):
        payload = draw(st.binary(max_size=min(room, 40)))
        if draw(st.booleans()):
            payload = payload.ljust(draw(st.integers(len(payload), room)), b"\x5a")
        room -= len(payload)
        total = draw(st.integers(1, 255))
        index = draw(st.integers(0, total - 1))
        entries.append(Entry(draw(st.integers(0, 15)), draw(octet), index, total, payload))
    pdu = Pdu(
        draw(st.integers(0, 3)), False, draw(octet), draw(octet), draw(octet),
        draw(st.integers(0, 15)), entries,
    )  # fmt: skip
    return pdu, pdu_size
