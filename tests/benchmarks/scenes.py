"""Tables and pictures of docs/scenes.md, from the sweeps of the scenes.

First run them, ``fabfem sweep cases/.../NAME.toml``, for the names in `SCENES` (and ``torsion_element``); then ``python
tests/benchmarks/scenes.py``. A scene whose sweep has not run is passed over.
"""

import csv
import json
from collections.abc import Callable, Iterable
from pathlib import Path

import matplotlib.pyplot as plt
import meshio
import numpy as np
from matplotlib.collections import PolyCollection

HOME = Path(__file__).parents[2]
Rows = list[dict[str, str]]
SLIP = 0.02, 0.04
"""Shear strain at which the averages of the hollow cylinder are compared [-]."""
SETTLED = 0.01, 0.025, 0.05
"""Settlement over B at which the footings are compared [-]."""

WEAKENED = 1.2, 1.5
"""Factors on the strength at which the slopes are compared."""


def rows(name: str) -> Rows:
    """Return the rows of a sweep with plain column names; those of the first column keep its name."""
    with (HOME / "results" / f"{name}_sweep" / "sweep.csv").open(encoding="utf-8") as file:
        header, *lines = csv.reader(file)
    plain = [column.partition(" [")[0] for column in header]
    plain = [plain[0], *(f"{column}'" if column == plain[0] else column for column in plain[1:])]
    return [dict(zip(plain, line, strict=True)) for line in lines]


def column(found: Rows, name: str) -> np.ndarray:
    """Return a column as numbers."""
    return np.array([float(row[name]) for row in found])


def cost(name: str, row: dict[str, str]) -> str:
    """Return how a run went: increments, cut-backs, most points held."""
    report = json.loads(
        (HOME / "results" / f"{name}_sweep" / row["folder"] / "report.json").read_text(encoding="utf-8")
    )
    held = max((step.get("held", 0) for step in report["increments"]), default=0)
    return f"{len(report['increments'])} | {len(report['cutbacks'])} | {held}"


def strip(name: str) -> None:
    """Print bearing capacity against bedding angle, and draw the curves."""
    found = [row for row in rows(name) if row["settlement"]]
    figure, axes = plt.subplots(figsize=(5.5, 3.6))
    for sand in dict.fromkeys(row["sand"] for row in found):
        mine = [row for row in found if row["sand"] == sand]
        s, q = column(mine, "settlement") / 0.9, column(mine, "q/(gamma B)")
        h = np.abs(column(mine[1:], "horizontal_force") / column(mine[1:], "footing_force"))
        at = " | ".join(f"{np.interp(x, s, q):.2f}" for x in SETTLED)
        print(f"| {sand} | {at} | {h[-1]:.3f} | {mine[-1]['status']} | {cost(name, mine[-1])} |")
        style = {"e": "-", "f": "--", "i": ":"}[sand[0]]
        colour = {"0": "C0", "30": "C1", "60": "C2", "90": "C3"}.get(sand.split()[-1], "k")
        axes.plot(100 * s, q, style, color=colour, label=sand)
    axes.set(xlabel="settlement / B [%]", ylabel="q / γB [-]")
    axes.legend(fontsize=7, ncols=2)
    save(figure, "scenes_strip")


def hollow_cylinder(name: str) -> None:
    """Print and draw how far the laboratory's averages are from the volume means and from the element test."""
    found = [row for row in rows(name) if row["load_factor"]]
    point = [row for row in rows(f"{name}_element") if row["stress_xx"]]
    figure, axes = plt.subplots(figsize=(5.5, 3.4))
    for wall, mark in (("0.03x0", "o"), ("0.04x0", "s")):
        gaps = []
        for alpha in dict.fromkeys(row["alpha"] for row in found):
            mine = [row for row in found if row["alpha"] == alpha and row["r_i"] == wall]
            lab, mean = (np.interp(SLIP, *along(mine, way, float(alpha))) for way in ("hgs", "mean"))
            tested = np.interp(
                SLIP, *element([row for row in point if float(row["alpha"]) == float(alpha)], float(alpha))
            )
            b = mine[-1]["mean_b"]
            spread = float(mine[-1]["deviation_q"]) / float(mine[-1]["mean_q"])
            pairs = " | ".join(f"{x:.2f} | {y:.2f} | {z:.2f}" for x, y, z in zip(lab, mean, tested, strict=True))
            print(
                f"| {1e3 * float(wall[:4]):.0f} | {alpha} | {pairs} | {100 * (lab / mean - 1)[1]:+.2f} % | "
                f"{float(mine[-1]['hgs_b']):.3f} | {float(b):.3f} | {100 * spread:.1f} % |"
            )
            gaps.append((float(alpha), 100 * (lab / mean - 1)[1]))
        axes.plot(*np.transpose(gaps), mark + "-", label=f"wall {50 - 1e3 * float(wall[:4]):.0f} mm of 50 mm")
    axes.axhline(0.0, color="k", lw=0.5)
    axes.set(xlabel="α [deg]", ylabel="laboratory over mean − 1 [%]")
    axes.legend()
    save(figure, "scenes_hollow_cylinder")


def along(found: Rows, way: str, alpha: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the shear strain ε1 - ε3 and half of σ1 - σ3 along the path that was asked for."""
    c, s = np.cos(np.radians(2.0 * alpha)), np.sin(np.radians(2.0 * alpha))
    of = {
        key: column(found, f"{way}_{key}") for key in ("eps_z", "eps_theta", "gamma", "sigma_z", "sigma_theta", "tau")
    }
    strain = (of["eps_z"] - of["eps_theta"]) * c + of["gamma"] * s
    return strain, 0.5 * (of["sigma_z"] - of["sigma_theta"]) * c + of["tau"] * s


def element(found: Rows, alpha: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the same of the element test, where x is the direction around the axis."""
    c, s = np.cos(np.radians(2.0 * alpha)), np.sin(np.radians(2.0 * alpha))
    e, t = ({key: column(found, f"{kind}_{key}") for key in ("zz", "xx", "xz")} for kind in ("strain", "stress"))
    return (e["zz"] - e["xx"]) * c + 2.0 * e["xz"] * s, 0.5 * (t["zz"] - t["xx"]) * c + t["xz"] * s


def triaxial(name: str) -> None:
    """Print the global curve and the scatter of rough and smooth platens."""
    found = [row for row in rows(name) if row["axial_strain"]]
    for contact in dict.fromkeys(row["contact"] for row in found):
        mine = [row for row in found if row["contact"] == contact]
        strain = column(mine, "axial_strain")
        for at in (0.01, 0.02, 0.04, 0.06):
            if at <= strain[-1] + 1e-9:
                of = {
                    key: np.interp(at, strain, column(mine, key))
                    for key in ("q", "mean_void_ratio", "void_ratio_deviation", "axial_strain_deviation")
                }
                print(f"| {contact} | {100 * at:.0f} % | " + " | ".join(f"{value:.4g}" for value in of.values()) + " |")
        print(f"    {mine[-1]['status']} {cost(name, mine[-1])}")


def biaxial(name: str) -> None:
    """Print, by viscosity and mesh, the peak, the last load and the share of the area that still deforms."""
    found = [row for row in rows(name) if row["axial_strain"]]
    for viscosity, cells in dict.fromkeys((row["viscosity"], row["cells"]) for row in found):
        mine = [row for row in found if (row["viscosity"], row["cells"]) == (viscosity, cells)]
        strain, q = column(mine, "axial_strain"), column(mine, "q")
        mean, apart = column(mine, "mean_strain_increment"), column(mine, "strain_increment_deviation")
        share = 1.0 / (1.0 + (apart / mean) ** 2)
        last = strain > strain[-1] - 0.01
        print(
            f"| {viscosity} | {cells} | {q.max():.1f} | {100 * strain[q.argmax()]:.1f} % | "
            f"{np.interp(0.06, strain, q):.1f} | {q[-1]:.1f} | {100 * strain[-1]:.1f} % | "
            f"{100 * np.median(share[last]):.0f} % | {mine[-1]['status']} | {cost(name, mine[-1])} |"
        )
    bands(name)


def bands(name: str) -> None:
    """Draw the axial strain at the end, a row of meshes for each viscosity."""
    runs = {(row["viscosity"], row["cells"]): row["folder"] for row in rows(name)}
    ranks = [list(dict.fromkeys(key[place] for key in runs)) for place in (0, 1)]
    figure, grid = plt.subplots(len(ranks[0]), len(ranks[1]), figsize=(6.0, 2.3 * len(ranks[0])), squeeze=False)
    for (viscosity, cells), folder in runs.items():
        axes = grid[ranks[0].index(viscosity), ranks[1].index(cells)]
        file = max((HOME / "results" / f"{name}_sweep" / folder).glob("fields_*.vtu"))
        mesh = meshio.read(file)
        (block,) = mesh.cells
        axial = 100 * mesh.cell_data["strain"][0][:, 1]
        drawn = PolyCollection(list(mesh.points[block.data[:, :4], :2]), array=axial, cmap="viridis")
        drawn.set_clim(0.0, 20.0)
        axes.add_collection(drawn)
        axes.set(aspect="equal", title=f"η = {viscosity}, {cells}", xlim=(-0.02, 0.02), ylim=(0.0, 0.08))
        axes.set_axis_off()
        axes.title.set_fontsize(8)
    figure.colorbar(drawn, ax=grid, label="axial strain [%]", shrink=0.6)
    figure.savefig(HOME / "docs" / f"scenes_{name}.png", dpi=100, bbox_inches="tight")


def slope(name: str) -> None:
    """Print the factor of safety against the angle of bedding, draw the displacement curves and the mechanisms."""
    folders = dict.fromkeys((row["bedding_angle"], row["folder"]) for row in rows(name))
    figure, axes = plt.subplots(figsize=(5.5, 3.4))
    for (angle, folder), style in zip(folders, "os^D", strict=True):
        at = HOME / "results" / f"{name}_sweep" / folder
        said = json.loads((at / "report.json").read_text(encoding="utf-8"))["factor_of_safety"]
        tried = said["tried"]
        stands = np.array(
            sorted((one["factor"], one["displacement"]) for one in tried if one["verdict"] == "equilibrium")
        )
        fails = np.array([(one["factor"], one["displacement"]) for one in tried if one["verdict"] == "collapse"])
        reached = " | ".join(f"{1000 * np.interp(factor, *stands.T):.0f}" for factor in WEAKENED)
        print(
            f"| {angle} | {said['last_equilibrium']:.4g} … {said['first_failure']:.4g} | {reached} | "
            f"{1000 * stands[-1, 1]:.0f} | {said['reason']} |"
        )
        (line,) = axes.plot(stands[:, 1], stands[:, 0], f"-{style}", markersize=4, label=f"{angle}°")
        axes.plot(fails[:, 1], fails[:, 0], style, markersize=5, color=line.get_color(), fillstyle="none")
    axes.set(xlabel="largest displacement [m]; hollow: flow that was ended", ylabel="factor on the strength")
    axes.legend(title="bedding")
    save(figure, f"scenes_{name}")
    mechanisms(name, folders)


def mechanisms(name: str, folders: Iterable[tuple[str, str]]) -> None:
    """Draw the shear strain of the last increment of the flow at the first failure, over its largest."""
    figure, grid = plt.subplots(2, 2, figsize=(7.5, 4.0), layout="constrained")
    for axes, (angle, folder) in zip(grid.flat, folders, strict=True):
        mesh = meshio.read(max((HOME / "results" / f"{name}_sweep" / folder).glob("fields_*.vtu")))
        strain = mesh.cell_data["strain_increment"][0]
        strain = strain - strain[:, :3].mean(axis=1)[:, None] * [1, 1, 1, 0, 0, 0]
        shear = np.sqrt((strain[:, :3] ** 2).sum(axis=1) + 2.0 * (strain[:, 3:] ** 2).sum(axis=1))
        drawn = PolyCollection(list(mesh.points[mesh.cells[0].data[:, :4], :2]), array=shear / shear.max())
        axes.add_collection(drawn)
        axes.autoscale()
        axes.set(aspect="equal", title=f"bedding {angle}°")
        axes.set_axis_off()
    figure.colorbar(drawn, ax=grid, label="shear strain increment over its largest", shrink=0.8)
    figure.savefig(HOME / "docs" / f"scenes_{name}_mechanism.png", dpi=90)


def save(figure: plt.Figure, name: str) -> None:
    """Write a picture of the documentation."""
    figure.tight_layout()
    figure.savefig(HOME / "docs" / f"{name}.png", dpi=110)


SCENES: dict[str, Callable[[str], None]] = {
    "strip_toyoura_bedding": strip,
    "torsion": hollow_cylinder,
    "triaxial_rough": triaxial,
    "biaxial_band": biaxial,
    "toyoura_bedding": slope,
    "toyoura_crest_load": slope,
    "toyoura_setback_load": slope,
}
"""What is made of the sweep of each scene."""

if __name__ == "__main__":
    for scene, show in SCENES.items():
        if (HOME / "results" / f"{scene}_sweep" / "sweep.csv").is_file():
            print(f"\n{scene}")
            show(scene)
