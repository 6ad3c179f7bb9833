"""The list of benchmarks, for `bench`, `make bench` and the tests."""

from typing import NamedTuple


class Benchmark(NamedTuple):
    """A benchmark: a module of `benchmarks`, called by the module's name."""

    sentence: str
    minutes: float
    """Approximate duration of a complete run on two cores, in minutes."""
    needs: tuple[str, ...] = ()
    """Debian packages that the benchmark requires."""
    peers: tuple[str, ...] = ()
    """Packages and programs of others, which are measured for comparison if installed."""
    has_rows: bool = True
    """Whether it prints rows with targets; it then accepts --quick, --json and --seed, and `make
    bench` runs it."""


BENCHMARKS: dict[str, Benchmark] = {
    "bus": Benchmark("The inner path: bus, queue, PDUs and back.", 1),
    "sealing": Benchmark(
        "Sealed PDUs: processor time, latency and octets.", 0.5, peers=("cryptography",)
    ),
    "repeats": Benchmark(
        "Messages over an air that loses PDUs: with repeats, and as others do it.", 3,
    ),
    "defaults": Benchmark("What a user gets who has configured nothing, under any load.", 2),
    "team": Benchmark(
        "Teams on one channel: hops, crowds, worst cases, and how soon routes heal.", 40
    ),
    "fleet": Benchmark(
        "Gateways over Zenoh: several that hear one robot, many robots, and what fails.", 3,
    ),
    "modem_path": Benchmark("The modem in a daemon: latency, and speed relative to real time.", 2),
    "realtime": Benchmark("Whole daemons in real time: latency, ages, load and start.", 8),
    "waterfall": Benchmark("Where a message's time goes in a daemon, stage by stage.", 1),
    "phy_per": Benchmark(
        "SNR that the modem needs, with the impairments of real radios.", 15,
        peers=("libliquid-dev", "gcc", "gnuradio"),
    ),
    "rough": Benchmark("The modem in motion, on a busy air, and through steps of gain.", 6),
    "phy_speed": Benchmark(
        "Samples per second on one core, transmit and receive.", 2,
        peers=("libliquid-dev", "gcc", "gnuradio"),
    ),
    "access": Benchmark("Medium access of two robots on one channel, at sample level.", 3),
    "ether": Benchmark("The simulated air with eight daemons, and in real time with two.", 3),
    "radio": Benchmark(
        "Daemons on SoapySDR test radios, under full load.", 5,
        needs=("libsoapysdr-dev", "g++"), peers=("gnuradio",),
    ),
    "flowgraphs": Benchmark("GNU Radio's flowgraphs as a modem.", 10, needs=("gnuradio",)),
    "pound": Benchmark(
        "Section VI of the Pound paper, next to common alternatives.", 60,
        peers=("iproute2", "eclipse-zenoh", "ros-jazzy-rclpy"),
    ),
    "timesync": Benchmark("Clock filters on the same time stamps.", 4),
    "latency": Benchmark(
        "The Sensors paper's assessment, next to MAVLink and XRCE-DDS.", 15, peers=("pymavlink",)
    ),
    "adapters": Benchmark(
        "The ROS 2 bridge: processor time a message, added latency, idle load.", 3,
        peers=("ros-jazzy-rclpy",),
    ),
    "phy_curves": Benchmark("Plots error rates next to the bound for any code.", 5, has_rows=False),
    "structure": Benchmark("Structure of the code: calls per message.", 0.2, has_rows=False),
    "radio.team": Benchmark(
        "Odometry and images over two test radios, both ways.", 1,
        needs=("libsoapysdr-dev", "g++"), has_rows=False,
    ),
    "peers.pound": Benchmark(
        "Laser and image through each peer of `pound`, without sdrlinkd.", 10,
        needs=("iproute2",), peers=("eclipse-zenoh", "ros-jazzy-rclpy"), has_rows=False,
    ),
}  # fmt: skip
