"""The team that is planned for."""

from sdrlinkd.config import parse_config
from sdrlinkd.plan import setting_of
from sdrlinkd.wire import make_registry

REGISTRY = make_registry(
    [("scan", "sensor_msgs/LaserScan"), ("odom", "nav_msgs/Odometry"), ("map", "nav_msgs/Path")]
)
CONFIG = """registry = "registry.csv"
backend = "ether"
[ether]
dir = "air"
[modem]
mcs = 3
[access]
policy = "{policy}"
nodes = [1, 2, 3]
[topic.scan]
qos = "latency"
lifespan_s = 0.05
[topic.map]
qos = "bulk"
"""


def setting(policy="none", robots=1, mcs=3):
    config = parse_config(CONFIG.format(policy=policy).replace("mcs = 3", f"mcs = {mcs}"))
    return setting_of(config, 1, robots, 1e-4, 0.0)
