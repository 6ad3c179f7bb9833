"""Starts the bridge: ros2 launch sdrlink_ros bridge.launch.py [params:=FILE] [runtime_dir:=DIR]."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def _bridge(context, *_args):  # noqa: ANN001, ANN002, ANN202
    """The node, with the parameter file and the runtime directory that were given, if any."""
    params, directory = (
        LaunchConfiguration(name).perform(context) for name in ("params", "runtime_dir")
    )
    return [
        Node(
            package="sdrlink_ros",
            executable="bridge",
            output="screen",
            respawn=True,
            respawn_delay=2.0,
            arguments=["--runtime-dir", directory] if directory else [],
            parameters=[params] if params else [],
        )
    ]


def generate_launch_description() -> LaunchDescription:
    """The launch description that ros2 launch asks for."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("params", default_value="", description="file of parameters"),
            DeclareLaunchArgument(
                "runtime_dir", default_value="", description="directory of the daemon's sockets"
            ),
            OpaqueFunction(function=_bridge),
        ]
    )
