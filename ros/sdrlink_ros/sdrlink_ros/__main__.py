"""`ros2 run sdrlink_ros bridge`, or `python -m sdrlink_ros`."""

import argparse
import sys

INSTALL = "source /opt/ros/$ROS_DISTRO/setup.bash"
ABOUT = """ROS 2 over sdrlinkd: topics that nodes of this robot publish appear at the other robots
as /robot_N/..., and theirs appear here. What is published here on /robot_N/... goes to robot N
alone.
"""


def main(argv: "list[str] | None" = None) -> int:
    """Run the bridge with the arguments of a command line; returns its exit status."""
    given = sys.argv[1:] if argv is None else argv
    parser = argparse.ArgumentParser(
        "sdrlink_ros",
        description=ABOUT,
        epilog="Parameters follow --ros-args, such as --ros-args -p deny:='[/odom]'. "
        "`ros2 param describe /sdrlink_bridge allow` explains one.",
    )
    parser.add_argument(
        "--runtime-dir",
        metavar="DIR",
        help="directory of the daemon's sockets (default: $SDRLINKD_RUNTIME_DIR, "
        "$XDG_RUNTIME_DIR/sdrlinkd or /run/sdrlinkd)",
    )
    at = given.index("--ros-args") if "--ros-args" in given else len(given)
    options = parser.parse_args(given[:at])
    try:
        import rclpy  # noqa: F401
    except ImportError as error:
        print(  # noqa: T201
            f"sdrlink_ros: this Python ({sys.executable}) has no rclpy ({error}); run: {INSTALL}",
            file=sys.stderr,
        )
        return 2
    try:
        import sdrlinkd.client  # noqa: F401
    except ImportError as error:
        print(  # noqa: T201
            f"sdrlink_ros: this Python has no client of sdrlinkd ({error}); "
            f"in a checkout of sdrlinkd, run: {sys.executable} -m pip install ./etc/client",
            file=sys.stderr,
        )
        return 2
    from sdrlink_ros.bridge import run

    return run(given[at:], options.runtime_dir)


if __name__ == "__main__":
    sys.exit(main())
