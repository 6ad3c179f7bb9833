"""Makes each built-in radio from its settings; loads its code with the first of its kind."""

import socket
from pathlib import Path

from backends.backend import RadioRequest
from backends.base import Radio
from backends.hub_address import hub_of
from backends.params import EtherParams, IqFileParams, LoopbackParams, ZmqParams
from backends.soapy import SoapyParams, SoapyRadio, SoapySettings


def make_loopback(loopback: LoopbackParams, request: RadioRequest) -> Radio:
    """Make a radio that hears itself through the simulated air."""
    from backends.loopback import LoopbackRadio

    return LoopbackRadio(
        request.make_channel(), request.needs.block_s, loopback.paced, loopback.hear_self
    )


def make_iqfile(iqfile: IqFileParams, request: RadioRequest) -> Radio:
    """Make a radio that plays a recording, writes one, or both."""
    from backends.iqfile import IqFileRadio

    return IqFileRadio(
        Path(iqfile.receive) if iqfile.receive else None,
        Path(iqfile.transmit) if iqfile.transmit else None,
        request.make_channel(),
        request.needs.block_s,
        paced=iqfile.paced,
        type_name=iqfile.format,
        receive_type=iqfile.receive_format,
    )


def make_ether(ether: EtherParams, request: RadioRequest) -> Radio:
    """Make a radio on a hub's air; the hub learns this process by its number."""
    from backends.ether import EtherRadio

    who = f"process {request.pid} on {socket.gethostname()}"
    return EtherRadio(hub_of(ether), request.node_id, who, request.patience)


def make_soapy(soapy: SoapyParams, request: RadioRequest) -> Radio:
    """Make a radio behind SoapySDR, with offset tuning if the settings call for it."""
    from backends.offset import OffsetRadio

    needs = request.needs
    settings = SoapySettings.of(soapy, needs.radio_rate_hz, needs.frequency_hz, needs.block_s)
    radio = SoapyRadio(settings, request.longest_s, request.patience)
    shifts = soapy.offset_tuning == "on" or (
        soapy.offset_tuning == "auto" and needs.oversampling > 1
    )
    return OffsetRadio(radio) if shifts else radio


def make_zmq(zmq: ZmqParams, request: RadioRequest) -> Radio:
    """Make a radio that exchanges samples with another program over ZeroMQ."""
    from backends.zmqstream import ZmqRadio

    return ZmqRadio(zmq, request.needs.block_s)
