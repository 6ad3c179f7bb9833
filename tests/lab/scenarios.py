"""Small scenarios as text, and what a run leaves behind on the machine."""

from pathlib import Path

SHIPPED = Path(__file__).parents[2] / "etc/scenarios"

ROBOTS = """
[[robot]]
id = 1
topics = ["cmd_vel"]

[[robot]]
id = 2
topics = ["cmd_vel"]
"""


def scenario_text(
    top: str = "", robots: str = ROBOTS, extra: str = "", pace: str = "lockstep"
) -> str:
    """Two robots at 1 Msps that take turns; `top`, `robots` and `extra` are more TOML."""
    return f"""title = "Two small robots"
pace = "{pace}"
duration_s = 1.5
settle_s = 0.5
{top}
[air]
rate_hz = 1e6
snr_db = 25.0
{robots}
[daemon.modem]
mcs = 2

[daemon.access]
policy = "tdma"
{extra}
"""


def write_scenario(folder: Path, **parts: str) -> Path:
    """Write the scenario to a file."""
    path = folder / "small.toml"
    path.write_text(scenario_text(**parts))
    return path


def processes_of(folder: Path) -> list[str]:
    """Command lines of the processes that mention `folder`."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            line = path.read_bytes().replace(b"\0", b" ").decode(errors="replace")
        except OSError:
            continue
        if str(folder) in line:
            found.append(line)
    return found
