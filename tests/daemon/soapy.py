"""Robots with test radios on one air."""

from contextlib import contextmanager

from tests.soapy_loopback import Bus


def device(bus, unit, model="usrp", more=""):
    """The value of soapy.device for this unit."""
    return f"driver=loopback,bus={bus},unit={unit},model={model},noise_db=-50{more}"


def on_soapy(robot, bus, model="usrp", modem="rate_hz = 1e6\n", soapy="", top="", more=""):
    """The configuration of a robot with its own radio."""
    return (
        f'namespace = "robot_{robot}"\nbackend = "soapy"\n{top}'
        f'[soapy]\ndevice = "{device(bus, robot, model, more)}"\ntx_enabled = true\n'
        f"tx_gain_db = 40.0\nrx_gain_db = 20.0\n{soapy}"
        f"[modem]\nfrequency_hz = 915e6\n{modem}"
    )


@contextmanager
def air(name):
    """The bus of test radios, for queries and injected faults."""
    with Bus(name) as bus:
        yield bus
