"""`log` beside real daemons."""

import signal

import pytest

from sdrlinkd.client import Publisher
from sdrlinkd.drive import read_drive
from sdrlinkd.errors import UserError
from tests.pairs import pair
from tests.programs import sdrlinkctl
from tests.waiting import wait_for
from tests.web.odometry import odometry

pytestmark = pytest.mark.slow


@pytest.mark.long
@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL])
def test_a_drive_of_two_robots(end, start_daemon, tmp_path):
    with pair(start_daemon, tmp_path / "hub") as daemons:
        options = [word for each in daemons for word in ("--runtime-dir", each.directory)]
        folder = tmp_path / "drive"
        with sdrlinkctl("log", folder, *options) as log:
            assert "keeping 2 daemons" in log.line()
            wait_for(lambda: (folder / "drive.mcap").exists())
            with Publisher(runtime_dir=daemons[1].directory) as out:

                def has_path():
                    out.send("/robot_2/odom", odometry(1.0, 2.0))
                    try:
                        drive = read_drive(folder)
                    except UserError:
                        return False  # not a report yet
                    if 1 not in drive.stations:
                        return False
                    delivery = drive.stations[1].deliveries.get((2, "/odom"))
                    is_received = delivery is not None and delivery.delivered > 5
                    is_drawn = all(len(drive.paths.get((2, at), ())) > 5 for at in (None, 1))
                    return is_received and is_drawn

                wait_for(has_path, 60.0)
            log.stop(end)
            if end is signal.SIGINT:
                assert "sdrlinkctl report" in log.out()
                assert "Traceback" not in log.err()
    drive = read_drive(folder)
    assert set(drive.stations) == {1, 2}
    assert drive.stations[1].deliveries[2, "/odom"].delivered > 5
    assert 0 < drive.pdr(1, 2, "/odom") <= 1
    assert {event.robot for _, event in drive.events} <= {1, 2}
