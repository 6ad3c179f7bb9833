"""Snapshots with just what a test is about; everything else is well."""

from msgspec.structs import replace

from tests.health import snapshots


def topic(number=1, name="/robot_1/odom", kind="nav_msgs/msg/Odometry", **more):
    return snapshots.topic(name, topic_id=number, type=kind, **more)


def neighbor(src, **more):
    """Without figures of the link but those given."""
    return snapshots.robot(src, **{"snr_db": None, "per_lately": None, **more})


def snapshot(node=1, uptime_s=1.0, topics=(), neighbors=(), dropped=None, **link):
    """Of robot `node`; `dropped` is that of its transmit ledger, and `link` changes its link."""
    whole = snapshots.snapshot(uptime_s, robots=neighbors, topics=topics)
    tx = replace(whole.link.tx, dropped=dropped or {})
    return replace(
        whole, node=node, namespace=f"robot_{node}", link=replace(whole.link, tx=tx, **link)
    )
