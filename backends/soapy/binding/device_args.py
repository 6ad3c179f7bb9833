"""Device arguments, SoapySDR's notation for selecting a device: `driver=hackrf,serial=…`."""


def parse_device_args(args: str) -> dict[str, str]:
    """Split `driver=hackrf,serial=…` into values by key; of repeated keys the first counts."""
    pairs = (part.partition("=") for part in reversed(args.split(",")))
    return {key.strip(): value.strip() for key, _, value in pairs}


def driver_of(args: str) -> str:
    """The driver that device arguments name (`hackrf` in `driver=hackrf,serial=…`), or empty."""
    return parse_device_args(args).get("driver", "")
