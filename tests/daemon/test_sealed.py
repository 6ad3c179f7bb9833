"""Two daemons that seal their PDUs, joined by UDP: what a test sends there is on the air."""

import socket

import pytest

from sdrlinkd.cli import run
from sdrlinkd.client import Publisher, Subscriber
from sdrlinkd.keyring import KeyFile, create_key_file, new_key, read_key_file
from sdrlinkd.wire import LostNumbers, parse, read_control_entries
from tests.programs import sdrlinkd
from tests.sealing import vectors
from tests.waiting import wait_for

CDR = b"\0\1\0\0"
SIZE = 220


@pytest.fixture
def ports():
    """Two UDP ports that nobody uses."""
    sockets = [socket.socket(type=socket.SOCK_DGRAM) for _ in range(2)]
    for each in sockets:
        each.bind(("127.0.0.1", 0))
    found = [each.getsockname()[1] for each in sockets]
    for each in sockets:
        each.close()
    return found


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Where the state is."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path


def text(robot, ports, keys, mode="seal", more=""):
    mine, other = ports if robot == 1 else ports[::-1]
    return (
        f'namespace = "robot_{robot}"\nbackend = "gnuradio"\n[gnuradio]\ntransport = "udp"\n'
        f'send = "127.0.0.1:{other}"\nreceive = "127.0.0.1:{mine}"\nrate_bit_s = 1e6\n'
        f'[link]\npdu_size = {SIZE}\n[security]\nmode = "{mode}"\nkeys = "{keys}"\n{more}'
    )


@pytest.fixture
def key_file(folder):
    path = folder / "team.key"
    create_key_file(path, new_key(0))
    return path


def installed(write_config, folder, robot, ports, key_file, **more):
    """A configuration, with the key installed for its robot."""
    config = text(robot, ports, folder / f"keys_{robot}.toml", **more)
    path = write_config(folder, config)
    assert run(["key", "install", "--new", str(key_file), "--config", str(path)]) == 0
    return config


@pytest.fixture
def team(start_daemon, write_config, folder, ports, key_file):
    """Two daemons with one key."""
    configs = [installed(write_config, folder, each, ports, key_file) for each in (1, 2)]
    return [start_daemon(config) for config in configs]


def proves(daemon, other):
    return other in daemon.snapshot().link.security.proven


def test_sealed_messages_arrive_and_recordings_do_not(team, ports, capsys):
    one, two = team
    wait_for(lambda: proves(one, 2) and proves(two, 1))
    assert run(["key", "check", "--with", "2", "--runtime-dir", str(one.directory)]) == 0
    assert "robot 2 has our key, and has proven to be alive" in capsys.readouterr().out
    with (
        Subscriber("/rx_robot_1/cmd_vel", directory=two.directory) as heard,
        Publisher(one.directory) as out,
    ):
        for number in range(20):
            out.send("/robot_1/cmd_vel", CDR + bytes([number]))
        got = [heard.receive(5).payload[4] for _ in range(20)]
    assert got == list(range(20))
    with one.control() as control:
        assert control.ask("check")["problems"] == []


def test_nobody_else_commands(team, ports):
    """What is sent to the port was heard on the air: clear, garbled, and of another key."""
    one, two = team
    wait_for(lambda: proves(two, 1))
    stranger = socket.socket(type=socket.SOCK_DGRAM)
    stranger.sendto(vectors.clear(vectors.SIMPLE, SIZE), ("127.0.0.1", ports[1]))
    forged = vectors.SealedFields(SIZE, vectors.SEAL, bytes(32), 0, 1 << 20, 0, vectors.SIMPLE)
    stranger.sendto(vectors.seal(forged), ("127.0.0.1", ports[1]))
    stranger.close()

    def dropped():
        return two.snapshot().link.rx.pdus_dropped

    wait_for(lambda: dropped().get("sec_cleartext") == 1 and dropped().get("sec_bad_tag") == 1)
    assert two.snapshot().link.rx.delivered == 0
    assert one.is_up()


def test_the_keys_change_while_all_runs(team, folder, capsys):
    one, two = team
    wait_for(lambda: proves(one, 2) and proves(two, 1))
    assert run(["key", "rotate", str(folder / "next.key"), "--config", str(one.config)]) == 0
    for daemon in team:
        capsys.readouterr()
        line = ["key", "install", str(folder / "next.key"), "--config", str(daemon.config)]
        assert run(line) == 0
        assert "the daemon has re-read: keys" in capsys.readouterr().out
    wait_for(lambda: all(each.snapshot().link.security.kid == 1 for each in team))

    def shown():
        capsys.readouterr()
        assert run(["key", "show", "--config", str(one.config)]) == 0
        return capsys.readouterr().out.splitlines()

    # On disk, too, in a moment.
    wait_for(lambda: shown()[1].endswith("(in use)"))
    # A third key takes the place of the one that is out of use.
    assert run(["key", "rotate", str(folder / "third.key"), "--config", str(one.config)]) == 0
    line = ["key", "install", str(folder / "third.key"), "--config", str(one.config)]
    assert run(line) == 0
    assert [each.split(",")[0] for each in shown()] == ["key 1", "key 2"]


def test_a_restart_is_believed_again(team):
    one, two = team
    wait_for(lambda: proves(one, 2) and proves(two, 1))
    one.ends_well()
    one.at_work()
    wait_for(lambda: proves(one, 2) and proves(two, 1))
    with (
        Subscriber("/rx_robot_1/odom", directory=two.directory) as heard,
        Publisher(one.directory) as out,
    ):
        out.send("/robot_1/odom", CDR)
        assert heard.receive(5) is not None


@pytest.mark.parametrize(("prepare", "says"), [
    ("none", "cannot be read (No such file or directory); sdrlinkctl key install puts a key there"),
    ("open", "others can read it (mode 0644); allowed: 0600"),
    ("no state", "security.state_dir:"),
])  # fmt: skip
def test_without_key_or_state_it_does_not_start(
    start_daemon, write_config, folder, ports, key_file, prepare, says
):
    keys, more = folder / "keys.toml", ""
    if prepare != "none":
        keys.write_bytes(key_file.read_bytes())
        keys.chmod(0o644 if prepare == "open" else 0o600)
    if prepare == "no state":
        more = f'state_dir = "{key_file}/state"\n'
    path = write_config(folder, text(1, ports, keys, more=more))
    with sdrlinkd("--config", path) as daemon:
        assert daemon.wait() == 2
        (line,) = [each for each in daemon.err().splitlines() if each]
    assert says in line


def test_a_second_daemon_of_the_same_robot_is_refused(write_config, folder, team, ports):
    other = folder / "other"
    other.mkdir()
    path = write_config(other, text(1, [ports[0] + 1, ports[1] + 1], folder / "keys_1.toml"))
    with sdrlinkd("--config", path) as daemon:
        assert daemon.wait() == 2
        assert "another daemon seals as robot 1" in daemon.err()


def test_key_install_says_what_is_left_to_do(write_config, folder, ports, key_file, capsys):
    path = write_config(folder, text(1, ports, folder / "keys.toml", mode="off"))
    assert run(["key", "install", str(key_file), "--config", str(path)]) == 0
    assert 'nothing is sealed yet: set mode = "seal" in [security]' in capsys.readouterr().out
    create_key_file(folder / "another.key", new_key(0))
    line = ["key", "install", str(folder / "another.key"), "--config", str(path)]
    assert run(line) == 2
    assert "another key with kid 0 is installed; allowed: the next key" in capsys.readouterr().err
    assert run([*line, "--replace"]) == 0


def fingerprint(path):
    return read_key_file(path).key[0].fingerprint.hex()[:16]


def states(folder):
    return sorted((folder / "state" / "sdrlinkd").glob("*.json"))


def test_numbers_that_are_lost_are_not_begun_again(write_config, folder, ports, key_file, capsys):
    path = write_config(folder, text(1, ports, folder / "keys.toml"))

    def install(*more):
        capsys.readouterr()
        code = run(["key", "install", *map(str, more), "--config", str(path)])
        told = capsys.readouterr()
        return code, told.out + told.err

    lost = "the numbers of key 0 are not here, so this robot may have used any"
    for _ in range(2):
        code, said = install(key_file)
        assert (code, lost in said, states(folder)) == (0, True, [])
    code, said = install("--new", key_file)
    assert (code, states(folder)) == (2, [])
    assert "--new: robot 1 has used key 0, and its numbers in " in said
    # A computer that has never seen the robot takes the word of its owner.
    (folder / "keys.toml").unlink()
    code, said = install("--new", key_file)
    assert (code, lost in said, len(states(folder))) == (0, False, 1)
    # All numbers are here since the first key, so the next one is known to be new.
    assert run(["key", "rotate", str(folder / "next.key"), "--config", str(path)]) == 0
    code, said = install(folder / "next.key")
    assert (code, "not here" in said, len(states(folder))) == (0, False, 2)
    # What is damaged counts as lost, however the key is installed again.
    (file,) = [each for each in states(folder) if fingerprint(folder / "next.key") in each.name]
    file.write_bytes(file.read_bytes()[:40])
    for how in ((), ("--replace",), ("--no-copy",)):
        code, said = install(*how, folder / "next.key")
        assert (code, "the numbers of key 1 are not here" in said) == (0, True), how
        assert len(file.read_bytes()) == 40
    code, said = install("--new", "--no-copy", folder / "next.key")
    assert (code, "--new: robot 1 has used key 1" in said) == (2, True)
    for each in states(folder):
        each.unlink()
    code, said = install("--replace", folder / "next.key")
    assert (code, states(folder)) == (0, [])
    assert "the numbers of key 1 are not here" in said


def test_a_robot_with_another_disk_seals_nothing_and_says_what_to_do(
    start_daemon, write_config, folder, ports, key_file
):
    config = installed(write_config, folder, 1, ports, key_file)
    with socket.socket(type=socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", ports[1]))
        other.settimeout(10)
        for each in states(folder):
            each.unlink()
        daemon = start_daemon(config)
        with Publisher(daemon.directory) as out:
            out.send("/robot_1/odom", CDR)
        for _ in range(3):
            (record,) = read_control_entries(parse(other.recv(SIZE), SIZE)).records
            assert isinstance(record, LostNumbers)
    verdict = daemon.snapshot().verdict
    assert verdict.level == "DOWN"
    assert verdict.reasons[0].startswith(
        "the numbers of key 0 are lost here, or it was never installed"
    )
    assert states(folder) == []


@pytest.mark.long
def test_a_robot_with_another_disk_is_helped(start_daemon, write_config, folder, ports, key_file):
    """Nothing is said but what its key file says, and the others."""
    configs = [installed(write_config, folder, each, ports, key_file) for each in (1, 2)]
    one, two = [start_daemon(config) for config in configs]
    wait_for(lambda: proves(one, 2) and proves(two, 1))
    one.ends_well()
    states(folder)[0].unlink()
    one.at_work()
    wait_for(lambda: proves(one, 2) and proves(two, 1), 60)
    assert len(states(folder)) == 2
    assert one.snapshot().link.security.key_days_left < 98


def test_a_file_with_too_many_keys_is_not_written(write_config, folder, ports, key_file, capsys):
    path = write_config(folder, text(1, ports, folder / "keys.toml"))
    assert run(["key", "install", "--new", str(key_file), "--config", str(path)]) == 0
    before = (folder / "keys.toml").read_bytes()
    two = folder / "two.key"
    create_key_file(two, KeyFile(key=[*new_key(1).key, *new_key(2).key]))
    assert run(["key", "install", str(two), "--config", str(path)]) == 2
    assert "3 keys; allowed: the one in use and the next one" in capsys.readouterr().err
    assert (folder / "keys.toml").read_bytes() == before
