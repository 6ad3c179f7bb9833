"""What nobody can know before the radio is opened; `--check` says so."""

from sdrlinkd.config.schema import Config


def unchecked(config: Config) -> list[str]:
    """What the file alone does not decide, in words, one thing each."""
    backend, policy = config.backend, config.access.policy
    found = {
        "soapy": _of_device(config),
        "ether": [f"whether a hub answers in {config.ether.dir} (nobody is asked)"],
        "iqfile": [f"whether {config.iqfile.receive} can be read (the recording is not opened)"]
        if config.iqfile.receive
        else [],
        "zmq": ["whether the flowgraph answers, and sends this rate and format (it is not asked)"],
        "gnuradio": ["whether the flowgraph answers (it is not asked)"],
    }.get(backend, [])
    if policy not in ("none", "auto") and found:
        found.append(f'whether access.policy "{policy}" fits what the radio can do')
    return found


def _of_device(config: Config) -> list[str]:
    soapy = config.soapy
    keys = ["frequency", "rate", "antennas" if soapy.rx_antenna or soapy.tx_antenna else ""]
    if soapy.tx_gains or soapy.rx_gains or (soapy.tx_gain_db, soapy.rx_gain_db) != (None, None):
        keys.append("gains")
    if soapy.settings or soapy.stream_args:
        keys.append("settings")
    asked = ", ".join(key for key in keys if key)
    told = f'whether "{soapy.device}" is there and takes this {asked}'
    return [f"{told} (the device is not opened; sdrlinkctl doctor --config FILE opens it)"]
