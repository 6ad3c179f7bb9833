"""A minimal Debian in a folder, of this host's suite and from this host's sources."""

import hashlib
import os
import shutil
import subprocess
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

from tests.machine import ROOT as NEEDS_ROOT
from tests.machine import lacks

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "etc/minimal-debian.sh"
EMULATE = ROOT / "etc/emulate-arm64.sh"
BUILDER = ("ca-certificates", "gcc", "libc6-dev", "make", "python3-dev", "python3-venv")
"""What `make deb` needs on a minimal system; python3-dev where a library comes as source."""
PATIENCE_S = 3600
OF_APT = ("/var/lib/apt/", "/var/lib/dpkg/", "/var/cache/", "/var/log/", "/tmp/", "/dev/shm/")
"""What apt and dpkg keep for themselves, and files of the tests."""


def lacking():
    """Why no such system can be made here; "" if one can."""
    if missing := [name for name in ("mmdebstrap", "dpkg") if shutil.which(name) is None]:
        return lacks(*missing)
    return "" if os.geteuid() == 0 else NEEDS_ROOT


def suite():
    """The host's: a package is for the system that built it."""
    lines = Path("/etc/os-release").read_text().splitlines()
    told = tomllib.loads(
        "\n".join(line if '"' in line else _quoted(line) for line in lines if line)
    )
    return told["VERSION_CODENAME"]


def _quoted(line):
    key, _, value = line.partition("=")
    return f'{key}="{value}"'


def call(*command, **more):
    """Output of a command of the host's; a failure includes it."""
    done = subprocess.run(
        [str(each) for each in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        stdin=subprocess.DEVNULL, text=True, check=False, timeout=PATIENCE_S, **more,
    )  # fmt: skip
    assert done.returncode == 0, f"{' '.join(map(str, command))}\n{done.stdout}"
    return done.stdout


@dataclass(frozen=True)
class Debian:
    """The system in the folder `path`, of the host's architecture or, emulated, for 64-bit ARM."""

    path: Path
    is_arm64: bool = False

    @classmethod
    def new(cls, path, *packages, is_arm64=False):
        """Make one with these packages."""
        made = cls(path, is_arm64)
        made._call("make", path, suite(), *packages)
        # Whoever installs a package has lists of packages.
        made.run("apt-get update -qq")
        return made

    def _call(self, *words):
        if not self.is_arm64:
            return call("sh", SCRIPT, *words)
        return call("env", "DEBIAN_ARCH=arm64", "sh", EMULATE, "sh", SCRIPT, *words)

    def copy(self, path):
        """The same system in another folder."""
        call("cp", "-a", self.path, path)
        return replace(self, path=path)

    def run(self, line, user="root"):
        """Output of a line that `user` types; it must succeed."""
        return self._call("run", self.path, user, line)

    def install(self, *packages):
        """Install packages of the archive, or files of the host's."""
        named = []
        for each in packages:
            if isinstance(each, Path):
                shutil.copy(each, self.path / "tmp" / each.name)
                named.append(f"/tmp/{each.name}")
            else:
                named.append(each)
        return self.run(f"apt-get install -y -q {' '.join(named)}")

    def files(self):
        """Every file with its content or target, by its path, but for what apt and dpkg keep."""
        found = {}
        for folder, names, files in os.walk(self.path):
            for name in (*names, *files):
                path = Path(folder, name)
                shown = f"/{path.relative_to(self.path)}"
                if not f"{shown}/".startswith(OF_APT):
                    found[shown] = _content(path)
        return found


def _content(path):
    if path.is_symlink():
        return str(path.readlink())
    if path.is_file():
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    return None
