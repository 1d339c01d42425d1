"""Dependencies point one way, in the order that docs/architecture.md writes down."""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ORDER = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
FOLDERS = {"cases", "docs", "fabfem", "meshes", "tests", "umat"}
PACKAGES = [
    *("umat", "fabfem", "fabfem/fem", "fabfem/parallel", "fabfem/boundary_value"),
    *("fabfem/laboratory", "fabfem/fabric_tests", "fabfem/study", "fabfem/verification", "fabfem/extremes"),
]
OUTSIDE = {"umat": {"llvmlite", "numba", "numpy", "scipy"}}
"""Packages that a layer may import besides the standard library."""


def ranks(package: str) -> dict[str, int]:
    """Return the place of each module in the documented order; modules of one place are told apart by commas."""
    line = re.search(rf"^ +{package}: (.*(?:\n {{8,}}.*)*)", ORDER, re.MULTILINE)
    assert line, f"docs/architecture.md does not list the modules of {package}"
    places = [place.split(",") for place in line.group(1).replace("\n", " ").split("<")]
    return {module.strip().removesuffix("/*"): rank for rank, place in enumerate(places) for module in place}


def modules(package: str) -> Iterator[tuple[str, Path]]:
    """Yield (module or sub-package below the package, file)."""
    for path in sorted((ROOT / package).rglob("*.py")):
        parts = path.relative_to(ROOT / package).with_suffix("").parts
        if parts[0] not in ("__init__", "__main__"):
            yield parts[0], path


def imports(path: Path) -> Iterator[str]:
    """Yield the full names of the modules that a file imports, those inside functions too."""
    inside = path.relative_to(ROOT).with_suffix("").parts
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            start = ".".join(inside[: len(inside) - node.level]) if node.level else ""
            base = ".".join(filter(None, [start, node.module]))
            yield from (f"{base}.{alias.name}" for alias in node.names)


def wrong_imports(package: str) -> Iterator[str]:
    """Yield a line for each import that points the wrong way."""
    order = ranks(package)
    inside = package.replace("/", ".") + "."
    for module, path in modules(package):
        for name in imports(path):
            other = name.removeprefix(inside).split(".")[0]
            if not name.startswith(inside) or other not in order or other == module:
                continue
            if order[other] >= order[module]:
                yield f"{path.relative_to(ROOT)} imports {name}"


@pytest.mark.parametrize("package", PACKAGES)
def test_every_module_has_its_place(package: str) -> None:
    missing = {module for module, _ in modules(package)} - set(ranks(package))
    assert not missing, f"docs/architecture.md does not say where in {package} these belong: {sorted(missing)}"


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_point_one_way(package: str) -> None:
    assert list(wrong_imports(package)) == []


def test_umat_stands_alone() -> None:
    allowed = OUTSIDE["umat"] | set(sys.stdlib_module_names) | {"umat"}
    foreign = [
        f"{path.name}: {name}"
        for _, path in modules("umat")
        for name in imports(path)
        if name.split(".")[0] not in allowed
    ]
    assert foreign == []


def test_only_drawing_imports_vtk() -> None:
    heavy = {"pyvista", "vtk", "vtkmodules", "matplotlib"}
    users = {module for module, path in modules("fabfem") for name in imports(path) if name.split(".")[0] in heavy}
    assert users == {"pictures"}


@pytest.mark.parametrize("module", ["umat", "fabfem", "fabfem.cli", "fabfem.case"])
def test_light_modules_stay_light(module: str) -> None:
    heavy = ("numba", "scipy", "vtkmodules", "meshio")
    code = f"import sys, {module}; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "[]"


def test_the_readme_and_the_automatic_run_test_alike() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    (command,) = [line for line in readme.splitlines() if line.endswith("-m pytest")]
    assert command in script.replace(" --quiet '", " '")


def test_top_level_folders_are_the_six() -> None:
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode != 0 or not listed.stdout:
        pytest.skip("not a git checkout")
    folders = {line.split("/")[0] for line in listed.stdout.splitlines() if "/" in line}
    assert {folder for folder in folders if not folder.startswith(".")} <= FOLDERS


def test_no_machine_path_or_host_is_written_down() -> None:
    places = re.compile("/" + r"(?:work|home|root|Users)/|(?:pypi|registry|mirror|proxy)\.[a-z0-9.-]+/simple")
    texts = [
        path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if path.suffix in {".py", ".md", ".toml"}
    ]
    texts += [*ROOT.glob("*.md"), *ROOT.glob("*.toml"), *ROOT.glob("*.cff")]
    assert [str(path) for path in texts if places.search(path.read_text(encoding="utf-8"))] == []
