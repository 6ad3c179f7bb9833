"""Radios of other packages: found by entry points, configured, made, and reported when broken."""

import importlib.metadata
import re
import sys
from pathlib import Path

import pytest

import phy
from sdrlinkd.client import Publisher, Subscriber
from sdrlinkd.config import Config, make_setup, parse_config, typed_config
from sdrlinkd.errors import ConfigError, UserError
from sdrlinkd.modem import access_words
from tests.modem.links import bursts, running, send

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "backends/README.md").read_text()
EXAMPLE = re.search(r"```python\n(.*?)```", PAGE, re.DOTALL)[1]
CDR = b"\0\1\0\0"
ACME = """backend = "acme"
[link]
pdu_size = 64
[modem]
rate_hz = 1e6
max_cfo_hz = 1e5
max_burst_s = 0.01
[acme]
gain = 0.25
"""


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Installs packages, like pip, where this process finds them; returns that folder."""
    site = tmp_path / "site"
    site.mkdir()
    monkeypatch.syspath_prepend(site)
    before = set(sys.modules)

    def put(package, entry_points, **modules):
        info = site / f"{package.replace('-', '_')}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
        points = "".join(f"{name} = {value}\n" for name, value in entry_points.items())
        (info / "entry_points.txt").write_text(f"[sdrlinkd.backends]\n{points}")
        for name, text in modules.items():
            (site / f"{name}.py").write_text(text)
        importlib.invalidate_caches()
        return site

    yield put
    for name in set(sys.modules) - before:
        if getattr(sys.modules[name], "__file__", None) and str(site) in sys.modules[name].__file__:
            del sys.modules[name]


@pytest.fixture
def acme(install):
    """The package from the page on adding a radio."""
    return install("acme-sdr", {"acme": "acme_radio:ENTRY"}, acme_radio=EXAMPLE)


def refused(text):
    """The reason why a configuration is refused."""
    with pytest.raises(ConfigError) as caught:
        parse_config(text, "f.toml")
    return str(caught.value)


def test_the_example_of_the_page_is_short():
    code = [line for line in EXAMPLE.splitlines() if line.strip()]
    assert len(code) <= 20


def test_a_configuration_may_name_a_radio_of_another_package(acme):
    config = parse_config(ACME)
    assert (config.backend, config.acme.gain, config.acme.hear_self) == ("acme", 0.25, True)
    assert config.hears_self
    assert parse_config('backend = "acme"').acme.gain == 0.5
    setup = make_setup(config, ROOT / "etc")
    assert setup.config.acme == config.acme


def test_its_section_is_checked_as_any_other(acme):
    assert refused(f"{ACME}gian = 1") == (
        "f.toml:10: acme.gian: unknown key; did you mean gain? allowed: gain, hear_self"
    )
    assert refused(ACME.replace("0.25", "2")) == (
        "f.toml:9: acme.gain: got 2; allowed: a number above 0 and at most 1"
    )


def test_its_name_is_among_those_allowed(acme):
    assert refused('backend = "acne"') == (
        'f.toml:1: backend: got "acne"; allowed: one of "acme", "direct", "ether", "gnuradio", '
        '"iqfile", "loopback", "soapy", "zmq"'
    )
    assert "did you mean acme?" in refused("[acne]")


def test_a_configuration_of_ours_does_not_look_for_packages(acme, monkeypatch):
    monkeypatch.setattr("importlib.metadata.entry_points", lambda **_: pytest.fail("looked for"))
    assert type(parse_config('backend = "loopback"\n[modem]\nmcs = 2')) is Config


def test_what_a_daemon_tells_of_its_configuration_is_understood(acme):
    assert typed_config({"backend": "acme", "acme": {"gain": 0.1}}).acme.gain == 0.1
    with pytest.raises(ConfigError, match="configuration of the daemon: unreadable here"):
        typed_config({"backend": "other", "other": {}})


def test_without_its_package_the_name_is_unknown():
    assert 'backend: got "acme"; allowed: one of "direct"' in refused('backend = "acme"')


@pytest.mark.slow
async def test_pdus_go_over_its_air(acme):
    config = parse_config(ACME)
    sent = list(bursts(3, 5))
    async with running(config) as (modem, listener):
        assert (listener.traits.kind, listener.traits.shares_air) == ("acme", False)
        send(modem, listener, sent)
        pdus = [pdu for burst in sent for pdu in burst.pdus]
        await listener.until(lambda: len(listener.pdus) == len(pdus))
        assert [heard.data for heard in listener.pdus] == pdus


def test_what_is_not_known_of_it_is_said(acme):
    phy.warm_up()
    (told,) = access_words(parse_config(ACME), 1)
    assert "assumed to be a radio that sends and receives at once" in told
    assert "unknown until the radio is open" in told


def test_a_message_goes_through_a_daemon_with_it(acme, start_daemon):
    node = start_daemon(ACME, before=f"import sys; sys.path.insert(0, {str(acme)!r}); ")
    with (
        Subscriber("/rx_robot_1/odom", directory=node.directory) as heard,
        Publisher(node.directory) as out,
    ):
        out.send("/robot_1/odom", CDR + b"12345678")
        assert heard.receive(20).payload == CDR + b"12345678"
    assert node.snapshot().carrier.kind == "acme"
    with node.control() as control:
        assert control.ask("config")["acme"] == {"gain": 0.25, "hear_self": True}


BROKEN = {
    "missing": ("nowhere:ENTRY", "cannot be loaded (ModuleNotFoundError: No module named"),
    "absent": ("acme_radio:OTHER", "cannot be loaded (AttributeError: "),
    "raises": ("raises:ENTRY", "cannot be loaded (ZeroDivisionError: division by zero)"),
    "other": ("acme_radio:AcmeRadio", "is of type type, not backends.Backend"),
    "named": ("acme_radio:ENTRY", 'calls itself "acme"'),
    "needy": (
        "needy:ENTRY",
        "has settings that are not a msgspec.Struct with a default for each key",
    ),
}
NEEDY = """
import msgspec
from backends import Backend
class Needy(msgspec.Struct):
    port: int
ENTRY = Backend(name="needy", settings=Needy, make="needy:make")
"""


@pytest.mark.parametrize("name", BROKEN)
def test_a_package_that_is_broken_is_named(install, name):
    value, why = BROKEN[name]
    install("broken-sdr", {name: value}, acme_radio=EXAMPLE, raises="1 / 0", needy=NEEDY)
    told = refused(f'drain_s = 1.0\nbackend = "{name}"')
    assert told.startswith(f'f.toml:2: backend: got "{name}" of package broken-sdr 1.0')
    assert f"but its entry {value} {why}" in told
    assert told.endswith("; allowed: another backend, or an intact package")
    # Nobody else is harmed.
    assert parse_config('backend = "loopback"').backend == "loopback"


@pytest.mark.slow
async def test_a_radio_whose_code_is_missing_is_told_when_it_is_opened(install):
    text = EXAMPLE.replace('make="acme_radio:', 'make="acme_driver:')
    install("acme-sdr", {"acme": "acme_radio:ENTRY"}, acme_radio=text)
    with pytest.raises(UserError, match=r'got "acme", whose code cannot be loaded: acme_driver:'):
        async with running(parse_config(ACME)):
            pass


def test_a_name_that_two_packages_give_is_refused(install):
    install("acme-sdr", {"acme": "acme_radio:ENTRY"}, acme_radio=EXAMPLE)
    install("acme-fork", {"acme": "acme_radio:ENTRY"})
    assert refused('backend = "acme"') == (
        'f.toml:1: backend: got "acme", which several packages define: '
        "acme-fork 1.0 and acme-sdr 1.0; allowed: a name that one package defines; uninstall the "
        "others"
    )


@pytest.mark.parametrize("name", ["loopback", "modem", "drain_s"])
def test_a_name_of_ours_stays_ours(install, name):
    install("greedy-sdr", {name: "acme_radio:ENTRY"}, acme_radio=EXAMPLE)
    assert type(parse_config('backend = "loopback"')) is Config
    if name != "loopback":
        assert f'backend: got "{name}"; allowed: one of "direct"' in refused(f'backend = "{name}"')
