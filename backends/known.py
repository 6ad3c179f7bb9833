"""What follows from settings alone, for radios without a device; nothing is opened here."""

from backends.backend import ModemNeeds, Presumption, simulated
from backends.base import BackendError, Patience
from backends.hub_address import hub_of
from backends.params import EtherParams, IqFileParams, ZmqParams

ETHER_LEAD_S = 0.0008
"""From the event loop to the hub, and from there to the other radios."""
ETHER_REMOTE_LEAD_S = 0.02
"""The same over a network: a round trip on a busy wireless one."""
ETHER_TURNAROUND_S = 1e-4


def alone(_settings: object, needs: ModemNeeds, turnaround_s: float | None) -> Presumption:
    """Presume a radio that no other robot hears: its properties are certain."""
    return Presumption(simulated(needs, turnaround_s, shares_air=False), "", is_sure=True)


def iqfile_problem(iqfile: IqFileParams, _needs: ModemNeeds) -> str:
    """What is wrong with [iqfile]: key, given, allowed; empty: nothing."""
    if iqfile.receive or iqfile.transmit:
        return ""
    return (
        'iqfile.receive, iqfile.transmit: both are ""; allowed with backend = "iqfile": a '
        "recording to play (name a recording, SigMF or raw), one to write, or both"
    )


def iqfile_unchecked(iqfile: IqFileParams) -> list[str]:
    """What cannot be checked about [iqfile] before the recording is opened."""
    if not iqfile.receive:
        return []
    return [f"whether {iqfile.receive} is readable (the recording is not opened)"]


async def ether_keeps_pace(ether: EtherParams, patience: Patience) -> bool:
    """Whether the hub keeps real time, as it says. Raises AbsentError when no hub answers."""
    from backends.ether import hub_keeps_pace

    return await hub_keeps_pace(hub_of(ether), patience)


def ether_problem(ether: EtherParams, _needs: ModemNeeds) -> str:
    """What is wrong with [ether]: key, given, allowed; empty: nothing."""
    if ether.dir and ether.hub:
        return f'ether.hub: got "{ether.hub}" beside ether.dir; allowed: one of the two'
    if ether.hub:
        try:
            hub_of(ether)
        except BackendError as error:
            return str(error)
    if ether.dir or ether.hub:
        return ""
    return (
        'ether.dir: got ""; allowed with backend = "ether": the folder of a hub, as in '
        "sdrlink-ether --dir FOLDER, or ether.hub with HOST:PORT of one on another computer"
    )


def ether_unchecked(ether: EtherParams) -> list[str]:
    """What cannot be checked about [ether] before the hub answers."""
    where = f"at {ether.hub}" if ether.hub else f"in {ether.dir}"
    return [f"whether a hub answers {where} (it is not queried)"]


def ether_presumption(
    ether: EtherParams, needs: ModemNeeds, turnaround_s: float | None
) -> Presumption:
    """Presume a radio on the ether; its hub decides the properties when the radio joins."""
    lead_s = ETHER_REMOTE_LEAD_S if ether.hub else ETHER_LEAD_S
    turn_s = ETHER_TURNAROUND_S if turnaround_s is None else turnaround_s
    told = (
        f"ether: assumed half duplex, turnaround {1e3 * turn_s:g} ms, blocks of "
        f"{1e3 * needs.block_s:g} ms; the hub reports the actual values at start"
    )
    return Presumption(simulated(needs, turn_s, lead_s), told, is_sure=False)


def zmq_problem(zmq: ZmqParams, _needs: ModemNeeds) -> str:
    """What is wrong with [zmq]: key, given, allowed; empty: nothing."""
    for key in ("send", "receive"):
        if not getattr(zmq, key):
            return (
                f'zmq.{key}: got ""; allowed with backend = "zmq": where the flowgraph is, such as '
                '"tcp://127.0.0.1:52001"'
            )
    return ""


def zmq_unchecked(_zmq: ZmqParams) -> list[str]:
    """What cannot be checked about [zmq] before the flowgraph answers."""
    return ["whether the flowgraph answers, and sends this rate and format (it is not queried)"]


def zmq_presumption(zmq: ZmqParams, needs: ModemNeeds, turnaround_s: float | None) -> Presumption:
    """Presume a sample stream; its settings decide its properties."""
    lead_s = zmq.lead_s + needs.block_s
    return Presumption(simulated(needs, turnaround_s, lead_s), "", is_sure=True)
