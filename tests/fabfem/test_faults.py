"""What can go wrong around a run: an interrupt, a full disk, a folder in use or not writable, a mesh cut short."""

import json
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from fabfem.case import CaseError
from fabfem.cli import main
from fabfem.commands.status import BAD_INPUT, INTERRUPTED, STOPPED
from fabfem.outcome import FolderError, claimed
from fabfem.output.checkpoints import newest
from fabfem.output.history import read_history
from fabfem.output.interrupt import held_back, patient
from fabfem.restart import Restart
from fabfem.run import run_case

ROOT = Path(__file__).parents[2]
ELEMENT = """
[scene]
kind = "element"

[material.soil]
model = "von_mises"
youngs_modulus = 2e4
yield_stress = 60.0

[initial]
p = 50.0

[[stage]]
name = "shear"
kind = "triaxial"
drainage = "drained"
shear_strain = 0.02
increments = 2000
"""


def command(case: Path, out: Path, *more: str) -> list[str]:
    return [sys.executable, "-m", "fabfem", "solve", str(case), "--out", str(out), *more]


def begun(case: Path, out: Path, rows: int, *more: str) -> "subprocess.Popen[str]":
    """Start a run and return it once its history has some rows."""
    run = subprocess.Popen([*command(case, out), *more], cwd=ROOT, stderr=subprocess.PIPE, text=True)
    while run.poll() is None and count(out) < rows:
        time.sleep(0.01)
    return run


def count(out: Path) -> int:
    file = out / "history.csv"
    return len(read_history(file)[1]) if file.is_file() and b"\n" in file.read_bytes() else 0


def slowed(folder: Path, extra: str = "") -> Path:
    """Return a case of many increments."""
    text = (folder / "case.toml").read_text(encoding="utf-8")
    text = text.replace("initial = 0.25, maximum = 0.25", "initial = 2e-3, maximum = 2e-3")
    (folder / "case.toml").write_text(text + extra, encoding="utf-8")
    return folder / "case.toml"


def content(out: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for end in ("csv", "vtu", "pvd") for file in sorted(out.glob(f"*.{end}"))}


def short(folder: Path) -> Path:
    """Return a case of a few increments, with a checkpoint after each."""
    text = (folder / "case.toml").read_text(encoding="utf-8")
    (folder / "case.toml").write_text(text + "\n[checkpoint]\nincrements = 1\n", encoding="utf-8")
    return folder / "case.toml"


def test_an_interrupt_leaves_a_checkpoint_of_the_last_row(folder: Path) -> None:
    out = folder / "out"
    run = begun(slowed(folder), out, 3, "--quiet")
    run.send_signal(signal.SIGINT)
    assert run.wait() == INTERRUPTED
    found = newest(out)
    assert found is not None
    assert found.start.number == count(out) >= 3
    assert json.loads((out / "report.json").read_text())["status"] == "interrupted"


def test_an_interrupted_element_test_is_resumed_to_the_last_bit(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text(ELEMENT, encoding="utf-8")
    run = begun(tmp_path / "case.toml", tmp_path / "out", 3, "--quiet")
    run.send_signal(signal.SIGINT)
    assert run.wait() == INTERRUPTED
    assert json.loads((tmp_path / "out" / "report.json").read_text())["status"] == "interrupted"
    run_case(tmp_path / "case.toml", tmp_path / "out", quiet=True, restart=Restart(resume=True))
    run_case(tmp_path / "case.toml", tmp_path / "whole", quiet=True)
    assert content(tmp_path / "out") == content(tmp_path / "whole")


def test_the_first_interrupt_waits_and_the_second_does_not() -> None:
    said: list[str] = []
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), patient(said.append) as asked:  # noqa: PT012
        assert not asked()
        with held_back():
            signal.raise_signal(signal.SIGINT)
            assert not asked()
        assert asked()
        assert "finished first" in said[0]
        signal.raise_signal(signal.SIGINT)
        pytest.fail("the second one did not arrive")
    assert signal.getsignal(signal.SIGINT) is before


def test_a_thread_that_is_not_the_main_one_runs_all_the_same(folder: Path) -> None:
    found = []
    thread = threading.Thread(target=lambda: found.append(run_case(folder / "case.toml", folder / "out", quiet=True)))
    thread.start()
    thread.join()
    assert found[0].status == "completed"


def test_a_folder_in_use_is_left_alone(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The lock goes with the process: after SIGKILL the folder is free at once, and the run goes on."""
    out = folder / "out"
    run = begun(slowed(folder), out, 3, "--quiet")
    try:
        for more in ([], ["--resume"]):
            assert main(["solve", str(folder / "case.toml"), "--out", str(out), *more]) == BAD_INPUT
            said = capsys.readouterr().err
            assert "another run is writing its results there" in said
            assert said.count("\n") == 1
        assert run.poll() is None
        before = count(out)
        while run.poll() is None and count(out) <= before:
            time.sleep(0.01)
        assert count(out) > before, "the first run does not go on"
    finally:
        run.kill()
        run.wait()
    short = folder / "case.toml"
    short.write_text(short.read_text().replace("2e-3", "0.5"), encoding="utf-8")
    assert main(["solve", str(short), "--out", str(out), "--quiet"]) == 0


def test_studies_keep_each_other_out(folder: Path) -> None:
    sweep = '\n[[sweep.parameter]]\nat = "material.sand.cohesion"\nname = "c"\nvalues = [1.0, 2.0]\n'
    (folder / "case.toml").write_text((folder / "case.toml").read_text() + sweep)
    with claimed(folder / "out"):
        assert main(["sweep", str(folder / "case.toml"), "--out", str(folder / "out"), "--quiet"]) == BAD_INPUT
        with pytest.raises(FolderError, match="another run is writing"), claimed(folder / "out"):
            pass


@pytest.mark.parametrize("limit", [1, 3000, 20000, 60000])
def test_a_file_that_cannot_grow(limit: int, folder: Path) -> None:
    """Whatever file it is that cannot be written, the run says so, ends with status 3, and goes on with more room."""
    case, out = short(folder), folder / "out"

    def bounded() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    done = subprocess.run(
        command(case, out, "--quiet"), cwd=ROOT, preexec_fn=bounded, stderr=subprocess.PIPE, text=True, check=False
    )
    assert done.returncode == STOPPED, done.stderr
    assert "cannot be written" in done.stderr
    assert "File too large" in done.stderr
    said = [line for line in done.stderr.splitlines() if not line.startswith("OMP: ")]  # which wants shared memory
    assert len(said) == 1
    assert not list(out.glob(".*.part"))
    run_case(case, out, quiet=True, restart=Restart(resume=True))
    run_case(case, folder / "whole", quiet=True)
    assert content(out) == content(folder / "whole")


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of its own with 1 MB."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(disk)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("no file system can be mounted here")
    yield disk
    subprocess.run(["umount", "-l", str(disk)], check=True)


def fill(disk: Path, but: int) -> None:
    """Fill a disk but for some bytes."""
    there = os.statvfs(disk)
    (disk / "other").write_bytes(bytes(there.f_bavail * there.f_frsize - but))


def test_a_full_disk_keeps_what_was_written(small_disk: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    case, out = short(folder), small_disk / "out"
    fill(small_disk, but=400_000)
    assert main(["solve", str(case), "--out", str(out), "--quiet"]) == STOPPED
    said = capsys.readouterr().err
    assert "No space left on device" in said
    assert said.count("\n") == 1
    assert newest(out) is not None
    assert json.loads((out / "report.json").read_text())["status"] == "running"
    (small_disk / "other").unlink()
    assert main(["solve", str(case), "--out", str(out), "--quiet", "--resume"]) == 0
    run_case(case, folder / "whole", quiet=True)
    assert content(out) == content(folder / "whole")


def test_a_disk_that_can_only_be_read(small_disk: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A result that is there stays as it is."""
    case, out = folder / "case.toml", small_disk / "out"
    assert main(["solve", str(case), "--out", str(out), "--quiet"]) == 0
    before = content(out)
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk)], check=True)
    for there in (out, small_disk / "new"):
        assert main(["solve", str(case), "--out", str(there), "--quiet"]) == BAD_INPUT
        said = capsys.readouterr().err
        assert "results cannot be written there (Read-only file system)" in said
        assert said.count("\n") == 1
    assert content(out) == before


@pytest.mark.parametrize("case", ["element/drained_triaxial.toml", "fabric/contacts_2d.toml"])
def test_a_full_disk_under_a_scene_without_mesh(
    case: str, small_disk: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fill(small_disk, but=0)
    (small_disk / "out").mkdir(exist_ok=True)
    assert main(["solve", str(ROOT / "cases" / case), "--out", str(small_disk / "out"), "--quiet"]) == STOPPED
    said = capsys.readouterr().err
    assert "No space left on device" in said
    assert said.count("\n") == 1


def test_a_sweep_does_not_keep_a_run_that_a_disk_ended(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is run again, where a run that stopped by itself is not."""
    from fabfem.study.worker import FINAL, Task, perform

    def full(*given: object) -> None:
        raise OSError(28, "No space left on device")

    import tomllib

    tables = tomllib.loads((folder / "case.toml").read_text())
    monkeypatch.setattr("fabfem.output.history.History.write", full)
    ran = perform(Task(tables, folder / "case.toml", folder / "out"))
    assert ran.status == "unwritten"
    assert ran.status not in FINAL
    with claimed(folder / "out"):
        assert perform(Task(tables, folder / "case.toml", folder / "out")).status == "failed"


def mesh_files() -> list[Path]:
    names = ("strip_half_coarse.inp", "strip_half_coarse.msh", "slope_2to1_coarse.msh", "slope_2to1_coarse.inp")
    return [ROOT / "meshes" / name for name in names]


@pytest.mark.parametrize("file", mesh_files(), ids=lambda file: file.name)
def test_a_mesh_cut_short_is_refused(file: Path, tmp_path: Path) -> None:
    """Wherever it is cut, within a line at the latest, it is refused, or it is the whole mesh."""
    from fabfem.fem.facets import MeshError
    from fabfem.fem.mesh_files import read_mesh

    whole, said = read_mesh(file), file.read_bytes()
    cut = tmp_path / file.name
    for part in range(1, 41):
        end = len(said) * part // 41
        cut.write_bytes(said[: end - said[:end].endswith(b"\n")])
        try:
            found = read_mesh(cut)
        except MeshError:
            continue
        assert len(found.cells) == len(whole.cells)
        for name in whole.boundaries:
            assert name not in found.boundaries or len(found.boundary(name)) == len(whole.boundary(name)), (part, name)


def test_a_case_with_a_mesh_cut_short(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mesh = folder / "small.inp"
    mesh.write_bytes(mesh.read_bytes()[: mesh.stat().st_size // 2])
    assert main(["solve", str(folder / "case.toml"), "--out", str(folder / "out")]) == BAD_INPUT
    said = capsys.readouterr().err
    assert "mesh.file" in said or "boundary" in said
    assert said.count("\n") == 1
    with pytest.raises(CaseError):
        run_case(folder / "case.toml", folder / "out", quiet=True)
    assert not (folder / "out").exists()
