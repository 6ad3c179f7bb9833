"""What is known of radios without a device from their settings alone: nothing is opened here."""

from backends.backend import ModemNeeds, Presumption, simulated
from backends.params import EtherParams, IqFileParams, ZmqParams

ETHER_LEAD_S = 0.002
"""From the event loop to the hub, on a busy machine."""
ETHER_TURNAROUND_S = 1e-4


def alone(_settings: object, needs: ModemNeeds, turnaround_s: float | None) -> Presumption:
    """Presume of a radio that no other robot hears: it is as it is made."""
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
    """What of [iqfile] nobody can know before the recording is opened."""
    if not iqfile.receive:
        return []
    return [f"whether {iqfile.receive} is readable (the recording is not opened)"]


def ether_problem(ether: EtherParams, _needs: ModemNeeds) -> str:
    """What is wrong with [ether]: key, given, allowed; empty: nothing."""
    if ether.dir:
        return ""
    return (
        'ether.dir: got ""; allowed with backend = "ether": the folder of a hub, as in '
        "sdrlink-ether --dir FOLDER"
    )


def ether_unchecked(ether: EtherParams) -> list[str]:
    """What of [ether] nobody can know before the hub is asked."""
    return [f"whether a hub answers in {ether.dir} (it is not queried)"]


def ether_presumption(
    _ether: EtherParams, needs: ModemNeeds, turnaround_s: float | None
) -> Presumption:
    """Presume of a radio on the ether: its hub says what it is like, once it is asked."""
    turn_s = ETHER_TURNAROUND_S if turnaround_s is None else turnaround_s
    told = (
        f"ether: assumed half duplex, turnaround {1e3 * turn_s:g} ms, blocks of "
        f"{1e3 * needs.block_s:g} ms; the hub reports the actual values at start"
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
    """What of [zmq] nobody can know before the flowgraph is asked."""
    return ["whether the flowgraph answers, and sends this rate and format (it is not queried)"]


def zmq_presumption(zmq: ZmqParams, needs: ModemNeeds, turnaround_s: float | None) -> Presumption:
    """Presume of a sample stream: it is as it is set."""
    lead_s = zmq.lead_s + needs.block_s
    return Presumption(simulated(needs, turnaround_s, lead_s), "", is_sure=True)
