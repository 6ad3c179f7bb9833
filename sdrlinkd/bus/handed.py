"""The header of a message from the air, as its consumers get it (bus document, 3.2)."""

from sdrlinkd.bus.envelope import OutHeader
from sdrlinkd.link import Delivered, MessageName
from sdrlinkd.localtime import LocalTimes


def header_of(
    message: Delivered, age_s: float | None, received_ns: int, times: LocalTimes
) -> OutHeader:
    """The header of a message that is `age_s` old (None: unknown) when it is handed over.

    `received_ns` is when it arrived, in ns since 1970.
    """
    header = OutHeader(
        s=message.topic.origin(message.src),
        n=message.number,
        tr=received_ns,
        ty=message.topic.type,
        g=message.lost_pdus,
        h=message.hops_left,
        age=None if age_s is None else round(age_s * 1e6),
        sn=message.snr_db,
        tl=times.published_ns,
        eb=times.published_error_us,
        ts=times.sampled_ns,
        es=times.sampled_error_us,
        se=message.is_sealed,
    )
    if header.s != message.src:
        header.v = message.src
    if message.series != message.topic_id:
        header.sr = message.series
    if age_s is not None:
        wait_s, reassembly_s, air_s, _ = message.parts(0.0)
        header.dw, header.dr = round(1e6 * wait_s), round(1e6 * reassembly_s)
        header.da = round(1e6 * air_s)
    _name(header, message.name)
    return header


def _name(header: OutHeader, name: MessageName) -> None:
    """Put in the name that the message has at all robots that hear it."""
    header.b, header.e, header.ps = name.boot_id, name.entry_id, name.more_pdus
    if name.is_numbered:
        header.pn = name.first_pdu
    else:
        header.sq = name.first_pdu
