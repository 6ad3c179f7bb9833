"""The package in a fresh system: it installs, and everything in it works."""

import gzip
import json
import re
import shutil

import pytest

from sdrlinkd import __version__
from tests.machine import lacks
from tests.packages.debian import ROOT, call

PROGRAMS = ("sdrlinkctl", "sdrlinkd", "sdrlink-ether", "sdrlink-gateway")
AS_THE_UNIT_STARTS_IT = """
mkdir -m 750 /run/node
chown sdrlink: /run/node
export RUNTIME_DIRECTORY=/run/node
setpriv --reuid sdrlink --regid sdrlink --clear-groups sdrlinkd >/tmp/node.log 2>&1 &
until [ -S /run/node/ctl.sock ]; do sleep 0.1; kill -0 $! || { cat /tmp/node.log; exit 1; }; done
as_a_member="setpriv --reuid robot --regid robot --groups sdrlink"
$as_a_member sdrlinkctl status --runtime-dir /run/node
kill $!
wait $!
rm -r /run/node
"""


def test_the_demo_delivers_every_message(installed):
    installed.run("sdrlinkctl demo --duration 2", user="robot")
    report = json.loads((installed.path / "home/robot/build/demo/report.json").read_text())
    assert [(each["name"], each["pdr"]) for each in report["runs"]] == [
        ("ofdm", 1.0), ("iqfile", 1.0), ("direct", 1.0),
    ]  # fmt: skip


def test_the_modem_is_compiled_already(installed):
    code = "from phy import engine; print(engine.use('compiled').told)"
    told = installed.run(f'/opt/sdrlinkd/bin/python3 -c "{code}"', user="robot")
    assert told.startswith("compiled for any ")
    assert not (installed.path / "home/robot/.cache/sdrlinkd").exists()


@pytest.mark.parametrize("program", PROGRAMS)
def test_every_program_is_in_the_path_and_has_its_page(installed, program):
    assert program in installed.run(f"{program} --help", user="robot")
    page = next((ROOT / "docs/man").glob(f"{program}.[1-8]"))
    there = installed.path / f"usr/share/man/man{page.suffix[1:]}/{page.name}.gz"
    assert gzip.decompress(there.read_bytes()) == page.read_bytes()


def test_the_extras_are_there(installed):
    libraries = "foxglove, matplotlib.pyplot, nicegui, prometheus_client, zenoh"
    installed.run(f"/opt/sdrlinkd/bin/python3 -c 'import {libraries}'", user="robot")
    assert "Zenoh" in installed.run("sdrlinkctl help fleet", user="robot")


def test_the_daemon_starts_with_the_configuration_of_the_package(installed):
    assert "the configuration is valid" in installed.run("sdrlinkd --check", user="sdrlink")
    told = installed.run(AS_THE_UNIT_STARTS_IT)
    assert "direct up" in told


def test_bash_completes_commands(installed):
    script = "/usr/share/bash-completion/completions/sdrlinkctl"
    typed = "COMP_WORDS=(sdrlinkctl dem) COMP_CWORD=1; _sdrlinkctl_completion sdrlinkctl"
    told = installed.run(f"bash -c '. {script}; {typed}; echo ${{COMPREPLY[*]}}'", user="robot")
    assert told == "demo\n"


def test_zsh_and_fish_find_completions_by_name(installed):
    share = installed.path / "usr/share"
    for program in ("sdrlinkctl", "sdrlink-ether", "sdrlink-gateway"):
        zsh = (share / f"zsh/vendor-completions/_{program}").read_text()
        assert zsh.startswith(f"#compdef {program}\n")
        fish = (share / f"fish/vendor_completions.d/{program}.fish").read_text()
        assert fish.startswith(f"complete --command {program} ")


def test_units_find_their_programs_and_wait_for_a_person(installed):
    units = sorted((ROOT / "systemd").glob("*.service"))
    for unit in units:
        there = installed.path / "usr/lib/systemd/system" / unit.name
        assert there.read_text() == unit.read_text()
        for program in re.findall(r"(?m)^Exec\w+=(\S+)", unit.read_text()):
            installed.run(f"test -x {program}")
    assert len(units) == 6
    assert not list((installed.path / "etc/systemd/system").rglob("sdrlink*"))


def test_a_bill_of_materials_names_all_that_it_brings(installed):
    told = json.loads(installed.run("cat /usr/share/doc/sdrlinkd/sbom.cdx.json"))
    assert told["bomFormat"] == "CycloneDX"
    listed = {
        each["name"].lower().replace("_", "-").replace(".", "-"): each["version"]
        for each in told["components"]
    }
    brought = installed.run(
        "/opt/sdrlinkd/bin/python3 -c 'from importlib.metadata import distributions as all_;"
        'print(*(f"{each.name}={each.version}" for each in all_()))\''
    )
    for each in brought.split():
        name, _, version = each.partition("=")
        assert listed[name.lower().replace("_", "-").replace(".", "-")] == version, name
    assert "numpy" in listed


def test_nobody_but_root_can_change_what_was_installed(installed):
    for kind in ("! -user root", "! -type l -perm /022"):
        assert installed.run(f"find /opt/sdrlinkd /etc/sdrlinkd {kind}") == ""


def test_it_is_bound_to_the_python_that_it_was_made_with(deb, installed):
    python = installed.run("/opt/sdrlinkd/bin/python3 -c 'import sys; print(sys.version_info[1])'")
    minor = int(python)
    needs = call("dpkg-deb", "-f", deb, "Depends")
    assert f"python3 (>= 3.{minor}), python3 (<< 3.{minor + 1})" in needs
    assert call("dpkg-deb", "-f", deb, "Version") == f"{__version__}\n"
    assert f"sdrlinkd {__version__}\n" == installed.run("sdrlinkd --version")


def test_nothing_tells_where_it_was_built(deb, installed):
    # The folder above both the package and what it was made of; kernels name their source.
    search = f"grep -rl --exclude=kernels-*.so {deb.parents[1]}"
    told = installed.run(f"{search} /opt/sdrlinkd /usr/share /etc/sdrlinkd || true")
    assert told == ""


def test_lintian_has_nothing_to_say(light, tmp_path):
    if shutil.which("lintian") is None:
        pytest.skip(lacks("lintian"))
    # zstd is Ubuntu's, and every dpkg reads it.
    call("lintian", "--no-cfg", "--allow-root", "--fail-on", "error,warning",
         "--suppress-tags", "malformed-deb-archive", light(tmp_path))  # fmt: skip
