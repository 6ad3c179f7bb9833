"""What follows from settings alone, for radios without a device; nothing is opened here."""

from backends.backend import ModemNeeds, Presumption, simulated
from backends.params import EtherParams, IqFileParams, ZmqParams

ETHER_LEAD_S = 0.002
"""Delay from the event loop to the hub on a busy machine."""
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
    return [f"whether {iqfile.receive} can be read (the recording is not opened)"]


def ether_problem(ether: EtherParams, _needs: ModemNeeds) -> str:
    """What is wrong with [ether]: key, given, allowed; empty: nothing."""
    if ether.dir:
        return ""
    return (
        'ether.dir: got ""; allowed with backend = "ether": the folder of a hub, as in '
        "sdrlink-ether --dir FOLDER"
    )


def ether_unchecked(ether: EtherParams) -> list[str]:
    """What cannot be checked about [ether] before the hub answers."""
    return [f"whether a hub answers in {ether.dir} (nobody is asked)"]


def ether_presumption(
    _ether: EtherParams, needs: ModemNeeds, turnaround_s: float | None
) -> Presumption:
    """Presume a radio on the ether; its hub decides the properties when the radio joins."""
    turn_s = ETHER_TURNAROUND_S if turnaround_s is None else turnaround_s
    told = (
        f"ether: taken for half duplex, turnaround {1e3 * turn_s:g} ms, in blocks of "
        f"{1e3 * needs.block_s:g} ms: the hub tells when the daemon is there"
    )
    return Presumption(simulated(needs, turn_s, ETHER_LEAD_S), told, is_sure=False)


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
    return ["whether the flowgraph answers, and sends this rate and format (it is not asked)"]


def zmq_presumption(zmq: ZmqParams, needs: ModemNeeds, turnaround_s: float | None) -> Presumption:
    """Presume a sample stream; its settings decide its properties."""
    lead_s = zmq.lead_s + needs.block_s
    return Presumption(simulated(needs, turnaround_s, lead_s), "", is_sure=True)
