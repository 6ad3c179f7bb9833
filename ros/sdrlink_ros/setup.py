"""The ROS 2 package sdrlink_ros: `colcon build`, or `pip install .` beside an rclpy."""

from setuptools import setup

NAME = "sdrlink_ros"

setup(
    name=NAME,
    version="0.1.0",
    description="ROS 2 topics between robots over software radio, through the daemon sdrlinkd",
    license="Apache-2.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", ["launch/bridge.launch.py"]),
        (f"share/{NAME}/systemd", ["systemd/sdrlink-ros.service"]),
    ],
    python_requires=">=3.10",
    install_requires=["setuptools", "pyzmq>=22.3"],
    entry_points={"console_scripts": [f"bridge = {NAME}.__main__:main"]},
    zip_safe=True,
)
