"""Device arguments, SoapySDR's own notation for which device is meant: `driver=hackrf,serial=…`."""


def parse_device_args(args: str) -> dict[str, str]:
    """The values of `driver=hackrf,serial=…` by key; of two values of one key the first."""
    pairs = (part.partition("=") for part in reversed(args.split(",")))
    return {key.strip(): value.strip() for key, _, value in pairs}


def driver_of(args: str) -> str:
    """The driver that device arguments name, `hackrf` of `driver=hackrf,serial=…`; or empty."""
    return parse_device_args(args).get("driver", "")
