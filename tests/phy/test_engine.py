"""The engines: what computes the modem, how its library is made, found, trusted and called."""

import ctypes.util
import importlib.util
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import phy
from phy import engine, kernels
from phy.testing import (
    ENTRIES,
    ArgumentBlock,
    compile_kernels,
    compute,
    files,
    library,
    targets,
)
from tests.phy import golden_calls
from tests.phy.signals import noise

SEED = 5
REPLAY = Path(__file__).with_name("replay.c")


@pytest.fixture(autouse=True)
def _as_before(monkeypatch):
    """Use the best engine again after each test, and what a test has put in its place no more."""
    yield
    monkeypatch.undo()
    engine.use("auto")


def everything():
    """Runs every kernel; returns what came of it: samples, events, figures."""
    rng = np.random.default_rng(SEED)
    params = phy.PathParams(rate_hz=5e6, centre_hz=9e8, clock_ppm=3.0, profile="tdl-a")
    path, front_end = phy.Path(params, rng), phy.FrontEnd(phy.FrontEndParams(-30.0), rng)
    transmitter, receiver, sense = phy.Transmitter(), phy.Receiver(), phy.EnergyDetector()
    told = []
    for mcs in range(len(phy.MCS_TABLE)):
        burst = transmitter.modulate([rng.bytes(100), rng.bytes(100)], mcs)
        samples = np.concatenate((noise(rng, 900, 1e-3), path.carry(burst)[1]))
        told += [front_end.receive(samples), phy.upsample(burst, 2)]
        told += [receiver.push(told[-2]), phy.Downsampler(2).push(told[-1])]
        sense.push(told[-4])
    long = transmitter.modulate([bytes(2000)], 0)
    told += [receiver.push(long), receiver.flush(), sense.busy_until, sense.noise_dbfs]
    # A header that cannot be read, and the window's slip on a long burst.
    bad = long.copy()
    bad[352 : 352 + 160] = rng.permutation(bad[352 : 352 + 160])
    told += [receiver.push(bad), receiver.flush(), receiver.counters]
    return told


def exactly(told):
    return [each.tobytes() if isinstance(each, np.ndarray) else repr(each) for each in told]


def on_numba(monkeypatch):
    """Have numba compile the kernels in this process, and call those."""

    def called(kernel):
        return lambda *given: kernel(
            *(x.packed if isinstance(x, ArgumentBlock) else x for x in given)
        )

    for name in ENTRIES:
        monkeypatch.setattr(compute, name, called(getattr(kernels, name)), raising=False)


@pytest.mark.long
def test_the_library_computes_what_the_kernels_do_to_the_last_bit(monkeypatch):
    engine.use("compiled")
    ours = exactly(everything())
    on_numba(monkeypatch)
    assert exactly(everything()) == ours


def test_numpy_hears_what_the_library_hears():
    def heard(name):
        used = engine.use(name)
        rng = np.random.default_rng(SEED)
        front_end = phy.FrontEnd(phy.FrontEndParams(-25.0), rng)
        burst = phy.Transmitter().modulate([rng.bytes(60)] * 2, 3)
        air = np.concatenate((np.zeros(1000), burst, np.zeros(3000))).astype(np.complex64)
        samples = front_end.receive(air)
        receiver, sense = phy.Receiver(), phy.EnergyDetector()
        events = receiver.push(samples)
        sense.push(samples)
        pdus = [(each.data, each.at) for each in events if isinstance(each, phy.PduHeard)]
        return used.name, samples, pdus, sense.busy_until, sense.noise_dbfs

    compiled, numpy = heard("compiled"), heard("numpy")
    assert (compiled[0], numpy[0]) == ("compiled", "numpy")
    assert np.abs(compiled[1] - numpy[1]).max() < 1e-5
    assert compiled[2] == numpy[2]
    assert len(numpy[2]) == 2
    assert compiled[3] == numpy[3]
    assert compiled[4] == pytest.approx(numpy[4], abs=1e-4)


@pytest.mark.parametrize("factor", [2, 4])
def test_numpy_resamples_alike(factor):
    rng = np.random.default_rng(SEED)
    x = noise(rng, 500, 1.0)
    found = []
    for name in ("compiled", "numpy"):
        engine.use(name)
        params = phy.PathParams(rate_hz=5e6, clock_ppm=20.0, delay_s=3.3e-7)
        late = phy.Path(params, np.random.default_rng(1)).carry(x)
        fast, down = phy.upsample(x, factor), phy.Downsampler(factor)
        parts = [down.push(each) for each in np.array_split(fast, 7)]
        found.append((late[1], fast, np.concatenate(parts)))
    for ours, other in zip(*found, strict=True):
        assert np.abs(ours - other).max() < 1e-4


def test_numpy_senses_alike_in_any_chunks_and_with_bad_samples():
    rng = np.random.default_rng(SEED)
    x = noise(rng, 6000, 1e-3)
    x[2000:2500] += noise(rng, 500, 1.0)
    x[3000:3200:40] = [np.nan, np.inf, 1e30, -np.inf, 1e7]
    cuts = np.sort(rng.integers(0, len(x), 12))
    states = []
    for name in ("compiled", "numpy"):
        engine.use(name)
        sense = phy.EnergyDetector()
        for part in np.split(x, cuts):
            sense.push(part)
        states.append((sense.busy_until, sense.noise_dbfs, sense.next_index))
    assert states[0] == pytest.approx(states[1], abs=1e-6)


def test_an_unknown_engine_is_refused():
    with pytest.raises(engine.EngineError, match='got "fast"; allowed: one of auto, compiled'):
        engine.use("fast")


@pytest.fixture
def without_library(monkeypatch, tmp_path):
    """No library anywhere, an empty folder for one, and none in use."""
    monkeypatch.setattr(files, "folders", lambda: iter([tmp_path / "libraries"]))
    engine.use("numpy")
    return tmp_path / "libraries"


def test_without_a_c_compiler_numpy_computes_and_says_why(without_library, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda _: None)
    known = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "ziglang" else known(name)
    )
    used = engine.use("auto")
    assert used.name == "numpy"
    assert "slow: no compiled modem: there is no C compiler: install gcc" in used.told
    with pytest.raises(engine.EngineError, match="pip install ziglang"):
        engine.use("compiled")


def test_without_numba_numpy_computes_and_says_what_to_install(without_library, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    used = engine.use("auto")
    assert (used.name, "-m pip install numba`" in used.told) == ("numpy", True)


def test_with_a_numba_that_fails_numpy_computes_and_says_why(
    without_library, monkeypatch, tmp_path
):
    """The kernels are those of this source, even in the folder of another one."""
    other = tmp_path / "elsewhere" / "phy"
    other.mkdir(parents=True)
    (other / "__init__.py").write_text("raise ImportError('another source')\n")
    monkeypatch.chdir(other.parent)
    (tmp_path / "numba.py").write_text("raise ImportError('no numba for this processor')\n")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{Path(phy.__file__).parents[1]}")
    used = engine.use("auto")
    assert (used.name, "no numba for this processor" in used.told) == ("numpy", True)
    assert not list(without_library.glob("*"))


def test_a_build_can_be_given_up(without_library, tmp_path, monkeypatch):
    compiling = tmp_path / "compiling"
    compiling.write_text("#!/bin/sh\necho 1\nexec sleep 600\n")
    compiling.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(compiling))

    class GivenUpError(Exception):
        """Nobody waits any more."""

    def give_up(done, total):
        if done:
            raise GivenUpError(done, total)

    with pytest.raises(GivenUpError, match=f"1, {len(ENTRIES) + 1}"):
        engine.use("auto", give_up)
    assert not list(without_library.glob("*"))


def test_where_nothing_can_be_written_there_is_no_library(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "executable", shutil.which("true"))
    monkeypatch.setattr(subprocess, "run", fake_compiler)
    (tmp_path / "file").write_text("")
    with pytest.raises(engine.BuildError, match=r"file/modem\.so: "):
        engine.build(engine.this(), tmp_path / "file" / "modem.so")


def fake_compiler(command, **_):
    Path(command[command.index("-o") + 1]).write_bytes(b"")
    return subprocess.CompletedProcess(command, 0)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with the library of this machine, where no other is looked for."""
    found = engine.fitting()
    folder = tmp_path / "libraries"
    folder.mkdir(mode=0o755)
    shutil.copy(found, folder / found.name)
    monkeypatch.setattr(files, "folders", lambda: iter([folder]))
    return folder


def test_the_library_of_this_machine_is_found(folder):
    assert engine.fitting().parent == folder


@pytest.mark.parametrize("place", ["file", "folder"])
def test_a_library_that_others_may_write_is_not_loaded(folder, place):
    path = next(folder.iterdir()) if place == "file" else folder
    path.chmod(0o777)
    assert engine.fitting() is None


def test_a_library_of_another_user_is_not_loaded(folder, monkeypatch):
    monkeypatch.setattr(os, "geteuid", lambda: 12345)
    own = Path.stat

    def stat(path, **options):
        found = list(own(path, **options))
        if path == Path(files.__file__):
            found[4] = 12345
        return os.stat_result([*found[:4], found[4] or 6789, *found[5:]])

    monkeypatch.setattr(Path, "stat", stat)
    assert engine.fitting() is None


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """A temporary folder, where nothing else can be written: neither the source nor the cache."""
    (tmp_path / "file").write_text("")
    (tmp_path / "tmp").mkdir(mode=0o777)
    monkeypatch.setattr(files, "BESIDE", tmp_path / "file" / "libraries")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    return tmp_path / "tmp"


def test_who_can_write_nowhere_else_keeps_the_library_in_a_temporary_folder(temporary):
    found = engine.fitting()
    assert found is None
    assert not list(temporary.iterdir())
    path = engine.place(engine.this())
    assert path.parent == temporary / f"sdrlinkd-{os.geteuid()}"
    path.write_bytes(b"")
    path.chmod(0o755)
    assert engine.fitting() == path


def test_a_temporary_folder_that_others_may_write_is_not_used(temporary):
    own = temporary / f"sdrlinkd-{os.geteuid()}"
    own.mkdir()
    own.chmod(0o777)
    (own / files.name_of(engine.this())).write_bytes(b"")
    assert engine.fitting() is None
    path = engine.place(engine.this())
    assert path.parent.parent == temporary
    assert path.parent != own
    assert path.parent.stat().st_mode & 0o777 == 0o700


def test_where_nothing_at_all_can_be_written_numpy_computes_and_says_so(temporary, monkeypatch):
    def none(*_, **__):
        raise FileNotFoundError(2, "No usable temporary directory found")

    monkeypatch.setattr(tempfile, "mkdtemp", none)
    monkeypatch.setattr(tempfile, "gettempdir", none)
    engine.use("numpy")
    used = engine.use("auto")
    assert (used.name, "No usable temporary directory" in used.told) == ("numpy", True)


def test_a_library_of_another_source_is_not_loaded(folder, monkeypatch):
    monkeypatch.setattr(files, "source_key", lambda: "0" * 16)
    assert engine.fitting() is None


def test_a_library_of_another_processor_is_not_loaded(folder, monkeypatch):
    path = next(folder.iterdir())
    path.rename(folder / path.name.replace(engine.this().name, "x86_64-00000000"))
    assert engine.fitting() is None


def test_of_a_family_only_members_load_its_library(folder, monkeypatch):
    path = next(folder.iterdir())
    v3 = engine.TARGETS["x86-64-v3"]
    path.rename(folder / files.name_of(v3))
    monkeypatch.setattr(platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(targets, "features_here", lambda: v3.needs | {"sse2"})
    assert files.target_of(engine.fitting()) == "any x86-64-v3"
    monkeypatch.setattr(targets, "features_here", lambda: v3.needs - {"avx2"})
    assert engine.fitting() is None
    monkeypatch.setattr(platform, "machine", lambda: "aarch64")
    assert engine.fitting() is None


def test_what_is_no_library_is_told(tmp_path):
    (tmp_path / "modem.so").write_text("no library")
    with pytest.raises(OSError, match=r"modem\.so"):
        library.load(tmp_path / "modem.so")
    with pytest.raises(OSError, match="no kernels"):
        library.load(Path(ctypes.util.find_library("m") or "libm.so.6"))


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (
            np.zeros(4),
            r"sanitise, argument 1: got dtype\('float64'\); allowed: a contiguous",
        ),
        (np.zeros((4, 2), np.complex64), "array of complex64, 1 dimensions"),
        (np.zeros(8, np.complex64)[::2], "allowed: a contiguous, aligned array"),
        (np.frombuffer(bytes(65), np.complex64, offset=1), "allowed: a contiguous, aligned array"),
        (np.zeros(8, np.complex64).view(np.recarray), "allowed: a contiguous, aligned array"),
        ([1j], r"got \[1j\]; allowed"),
    ],
)
def test_what_a_kernel_does_not_take_is_refused(given, told):
    engine.use("compiled")
    with pytest.raises(TypeError, match=told):
        compute.sanitise(given, 1e6)


@pytest.mark.parametrize("given", [(), (1e6,), (np.zeros(2, np.complex64), 1e6, 2)])
def test_a_kernel_takes_as_many_arguments_as_it_has(given):
    engine.use("compiled")
    with pytest.raises(TypeError):
        compute.sanitise(*given)


def test_a_number_or_a_block_that_is_none_is_refused():
    engine.use("compiled")
    x = np.zeros(600, np.complex64)
    with pytest.raises(TypeError, match="real number"):
        compute.sanitise(x, "1e6")
    with pytest.raises(AttributeError, match="address"):
        compute.strongest(x, 100, None)


def test_kernels_of_several_threads_run_at_once_and_keep_nothing_alive():
    engine.use("compiled")
    x = np.ones(200_000, np.complex64)
    before = sys.getrefcount(x)
    with ThreadPoolExecutor(4) as pool:
        assert set(pool.map(lambda _: compute.sanitise(x, 2.0), range(40))) == {0}
    assert sys.getrefcount(x) == before


@pytest.mark.parametrize("what", ["Python", "NumPy"])
def test_objects_in_another_form_are_noticed(monkeypatch, what):
    if what == "Python":
        monkeypatch.setattr(library, "HEAD_BYTES", 32)
    else:
        monkeypatch.setattr(library, "content_of", lambda _: 0)
    with pytest.raises(OSError, match=f"this {what} keeps"):
        library.load(engine.fitting())


def test_arrays_that_may_not_be_written_and_empty_ones_are_taken():
    engine.use("compiled")
    x = np.ones(8, np.complex64)
    x.flags.writeable = False
    sense = phy.EnergyDetector()
    sense.push(x)
    sense.push(x[:0])
    assert sense.next_index == 8


@pytest.mark.long
def test_a_library_for_the_whole_family_computes_the_same(tmp_path, monkeypatch):
    engine.use("compiled")
    ours = everything()
    path = tmp_path / "modem.so"
    engine.build([each for each in engine.TARGETS.values() if each.fits][-1], path)
    for name, kernel in library.load(path).items():
        monkeypatch.setattr(compute, name, kernel, raising=False)
    # Of noise, sums in another order are allowed.
    for one, other in zip(ours, everything(), strict=True):
        if isinstance(one, np.ndarray):
            assert np.abs(one - other).max() < 1e-5
        elif isinstance(one, list):
            pdus = [[e.data for e in each if isinstance(e, phy.PduHeard)] for each in (one, other)]
            assert pdus[0] == pdus[1]
        else:
            assert one == pytest.approx(other)


def some_of_everything():
    """Runs every kernel on little."""
    rng = np.random.default_rng(SEED)
    transmitter, receiver, sense = phy.Transmitter(), phy.Receiver(), phy.EnergyDetector()
    path = phy.Path(phy.PathParams(rate_hz=5e6, centre_hz=9e8, clock_ppm=3.0), rng)
    front_end = phy.FrontEnd(phy.FrontEndParams(-25.0), rng)
    for mcs in (1, 6):
        burst = path.carry(transmitter.modulate([rng.bytes(40)], mcs))[1]
        samples = front_end.receive(np.concatenate((noise(rng, 600, 1e-3), burst)))
        sense.push(samples)
        receiver.push(samples)
        receiver.flush()
    phy.Downsampler(2).push(phy.upsample(burst[:200], 2))
    bad = transmitter.modulate([bytes(10)], 0)
    bad[352:512] = rng.permutation(bad[352:512])
    receiver.push(bad)
    receiver.flush()
    excisor = phy.Excisor()
    x = phy.Jammer("tone", 20, 1e6, 1, offset_hz=1e5).add(noise(rng, 17_000), 0)
    excisor.push(phy.Jammer("pulses", 50, 1e6, 1, period_s=1e-3).add(x, 0))


def test_the_recorded_calls_are_of_every_kernel(monkeypatch):
    engine.use("compiled")
    ran = {name for name, _ in golden_calls.recorded(monkeypatch, some_of_everything)}
    # These only measurements and 802.11a need.
    assert set(ENTRIES) - ran == {"encode_blocks", "decode_rows", "learn_channel", "slip"}


@pytest.mark.long
def test_kernels_for_64_bit_arm_repeat_recorded_calls(tmp_path, monkeypatch):
    """On an emulated processor: every kernel, with what it read and what it left here."""
    engine.use("compiled")
    calls = golden_calls.recorded(monkeypatch, some_of_everything)
    (tmp_path / "calls").write_bytes(golden_calls.packed(calls))
    (tmp_path / "kernels.h").write_text("\n".join(f"KERNEL({name})" for name in ENTRIES))
    compile_kernels(engine.TARGETS["aarch64"], tmp_path / "kernels.o")
    program = tmp_path / "replay"
    subprocess.run(
        [
            *(sys.executable, "-m", "ziglang", "cc", "-target", "aarch64-linux-musl", "-static"),
            *("-O1", "-I", str(tmp_path), "-o", str(program), str(REPLAY)),
            *(str(tmp_path / "kernels.o"), "-lm"),
        ],
        check=True,
    )  # fmt: skip
    done = subprocess.run(
        ["qemu-aarch64-static", program, tmp_path / "calls"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-2000:]
    assert {line.split()[0] for line in done.stdout.splitlines()} == {name for name, _ in calls}


def test_the_calls_compile_without_a_warning(tmp_path):
    (tmp_path / "kernels.h").write_text(library.header())
    source = Path(engine.__file__).with_name("call.c")
    command = [sys.executable, "-m", "ziglang", "cc", "-Wall", "-Wextra", "-Werror", "-I", tmp_path]
    subprocess.run([*command, "-c", source, "-o", tmp_path / "call.o"], check=True)


def test_no_kernel_takes_or_leaves_more_words_than_a_call_has_room_for():
    def words(fields):
        return sum(1 + each.n_dimensions + (each.dtype.kind == "c") for each in fields)

    source = Path(engine.__file__).with_name("call.c").read_text()
    room = {key: int(n) for key, n in re.findall(r"(MOST_\w+) = (\d+)", source)}
    assert max(words(entry.arguments) for entry in ENTRIES.values()) <= room["MOST_WORDS"]
    assert max(words(entry.results) for entry in ENTRIES.values()) <= room["MOST_RESULTS"]
