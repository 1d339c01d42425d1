"""Calibration: parameters of a case fitted to measured curves by least squares.

The parameters are fitted over the distance of their bounds, or of the logarithms of these; derivatives are differences
whose runs go on in parallel. Runs are kept, so that a fit that was stopped goes on from where it was. It leaves
``calibration.json``, ``calibration.csv`` with a row for each parameter, and ``calibration_curves.csv`` with what was
measured beside what the case answers.
"""

import csv
import json
from collections.abc import Sequence
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console

from fabfem.case import Case, CaseError, read_case, read_tables
from fabfem.case.study import Calibration, Fitted
from fabfem.outcome import make_folder
from fabfem.output.atomic import write_atomic
from fabfem.study.certainty import Certainty, blind_spots, certainty
from fabfem.study.measured import Curves, answers, curve_table, measured_curves, residuals
from fabfem.study.processes import Pool, limits
from fabfem.study.quantity import QuantityError
from fabfem.study.store import Plan, Run, runs
from fabfem.study.sweep import asked
from fabfem.study.variants import Choice, Setting, Tables
from umat.mandel import Array


class Calibrated(NamedTuple):
    """What a calibration found."""

    folder: Path
    """Where its files are."""
    values: dict[str, float]
    """Fitted parameters."""
    sentences: tuple[str, ...]
    """What it comes to."""


def calibrate(path: Path, folder: Path, quiet: bool = False) -> Calibrated:
    """Fit the parameters that a case file names and write what was found.

    Raises
    ------
    CaseError
        If the case has no calibration, its data cannot be used, or a run has no answer to them.
    """
    case = read_case(path)
    said = asked(case, case.calibration, "calibration")
    measured = measured_curves(said, case.locate(said.data), path.name)
    make_folder(folder)
    start = np.array([to_unit(fitted, fitted.start) for fitted in said.parameter])
    with Pool(limits(said.workers, said.memory)) as pool:
        fit = Fit(case, said, measured, read_tables(path), folder, pool, Console(stderr=True, quiet=quiet))
        return _write(fit, start, fit.solve(start))


class Fit:
    """The residuals of a calibration and their derivatives, as functions of the parameters over their bounds."""

    def __init__(
        self,
        case: Case,
        said: Calibration,
        measured: list[Curves],
        tables: Tables,
        folder: Path,
        pool: Pool,
        console: Console,
    ) -> None:
        self.case, self.said, self.measured, self.tables = case, said, measured, tables
        self.folder, self.pool, self.console = folder, pool, console
        self.known: dict[tuple[float, ...], list[tuple[Array, ...]]] = {}

    def solve(self, start: Array) -> Array:
        """Return the best parameters over their bounds."""
        from scipy.optimize import least_squares

        found = least_squares(
            self.residual,
            start,
            jac=self.jacobian,
            bounds=(0.0, 1.0),
            xtol=self.said.tolerance,
            ftol=None,
            gtol=None,
            max_nfev=self.said.evaluations,
        )
        return np.asarray(found.x)

    def residual(self, unit: Array) -> Array:
        """Return the residuals of all tests."""
        self.answer([unit])
        found = self._joined(unit)
        values = ", ".join(f"{p.name} {_from_unit(p, z):.5g}" for p, z in zip(self.said.parameter, unit, strict=True))
        self.console.print(f"{values}: rms {np.sqrt(np.mean(found**2)):.5g}", markup=False, highlight=False)
        return found

    def jacobian(self, unit: Array) -> Array:
        """Return (m, n) the derivatives of the residuals, by differences into the bounds."""
        steps = np.where(unit + self.said.step <= 1.0, self.said.step, -self.said.step)
        moved = [unit + step * row for step, row in zip(steps, np.eye(len(unit)), strict=True)]
        self.answer([unit, *moved])
        here = self._joined(unit)
        return np.stack([(self._joined(other) - here) / step for other, step in zip(moved, steps, strict=True)], axis=1)

    def answer(self, units: Sequence[Array]) -> None:
        """Run all tests with some sets of parameters that have not been run."""
        new = [unit for unit in units if tuple(unit) not in self.known]
        wanted = {(tuple(unit), n): self._choice(unit, n) for unit in new for n in range(len(self.measured))}
        plan = Plan(self.tables, self.case.path, self.folder, list(wanted.values()))
        found = {run.choice: run for run in runs(plan, self.pool)}
        for unit in new:
            ended = [found[wanted[tuple(unit), n]] for n in range(len(self.measured))]
            self.known[tuple(unit)] = [self._answers(*pair) for pair in zip(self.measured, ended, strict=True)]

    def _choice(self, unit: Array, number: int) -> Choice:
        own = [Setting("", (place,), value) for place, value in self.said.test[number].set.items()]
        fitted = zip(self.said.parameter, unit, strict=True)
        return (*own, *(Setting(p.name, p.at, float(_from_unit(p, z))) for p, z in fitted))

    def _answers(self, measured: Curves, run: Run) -> tuple[Array, ...]:
        try:
            return answers(self.said, measured, run.history())
        except QuantityError as error:
            why = run.ran.reason or str(error)
            raise CaseError(f"{self.case.path.name}: calibration: no answer to {measured.name}: {why}") from error

    def _joined(self, unit: Array) -> Array:
        pairs = zip(self.measured, self.known[tuple(unit)], strict=True)
        return np.concatenate([residuals(self.said, measured, answered) for measured, answered in pairs])

    def rms(self, unit: Array) -> dict[str, dict[str, float]]:
        """Return the root mean square difference of each curve of each test, and of all tests, in units of the data."""
        gaps: dict[str, dict[str, Array]] = {}
        for measured, answered in zip(self.measured, self.known[tuple(unit)], strict=True):
            parts = zip(self.said.curve, measured.values, answered, strict=True)
            gaps[measured.name] = {curve.data: answer - value for curve, value, answer in parts}
        columns = [curve.data for curve in self.said.curve]
        gaps["all"] = {column: np.concatenate([gap[column] for gap in gaps.values()]) for column in columns}
        return {name: {c: float(np.sqrt(np.mean(g**2))) for c, g in gap.items()} for name, gap in gaps.items()}


def to_unit(fitted: Fitted, value: float) -> float:
    """Return where a value lies between the bounds, 0…1."""
    low, high, here = (np.log(x) if fitted.scale == "logarithmic" else x for x in (fitted.lower, fitted.upper, value))
    return float((here - low) / (high - low))


def _from_unit(fitted: Fitted, unit: float) -> float:
    """Return the value at a place between the bounds."""
    if fitted.scale == "logarithmic":
        return float(fitted.lower * (fitted.upper / fitted.lower) ** unit)
    return float(fitted.lower + unit * (fitted.upper - fitted.lower))


def _write(fit: Fit, start: Array, best: Array) -> Calibrated:
    known = certainty(fit.residual(best), fit.jacobian(best))
    fit.answer([start])
    parameters = fit.said.parameter
    values = {p.name: _from_unit(p, z) for p, z in zip(parameters, best, strict=True)}
    sentences = (*_fitted(parameters, best, known), *_fits(fit, best), *blind_spots(list(values), known))
    content = {
        "case": fit.case.path.name,
        "parameters": values,
        "covariance": _listed(known.covariance),
        "covariance_of": "the parameters, or their logarithms, over the distance of their bounds",
        "correlation": _listed(known.correlation),
        "singular_values": known.singular_values.tolist(),
        "directions": _listed(known.directions),
        "rms": fit.rms(best),
        "rms_at_start": fit.rms(start),
        "sentences": sentences,
    }
    write_atomic(fit.folder / "calibration.json", json.dumps(content, indent=1) + "\n")
    write_atomic(fit.folder / "calibration.csv", _parameter_table(parameters, best, known))
    write_atomic(
        fit.folder / "calibration_curves.csv",
        curve_table(fit.said, list(zip(fit.measured, fit.known[tuple(best)], strict=True))),
    )
    return Calibrated(fit.folder, values, sentences)


def _fitted(parameters: Sequence[Fitted], best: Array, known: Certainty) -> list[str]:
    """Return a sentence for each parameter: its value, and the range of one standard deviation."""
    found = []
    for p, z, deviation in zip(parameters, best, known.deviations, strict=True):
        low, high = (_from_unit(p, float(np.clip(z + side * deviation, 0.0, 1.0))) for side in (-1.0, 1.0))
        bound = " It lies at a bound." if min(z, 1.0 - z) < 1e-3 else ""
        found.append(f"{p.name} = {_from_unit(p, z):.5g} ({low:.5g} to {high:.5g}, one standard deviation).{bound}")
    return found


def _fits(fit: Fit, best: Array) -> list[str]:
    """Return the root mean square difference of each test in a sentence."""
    return [
        f"Root mean square difference, {name}: {', '.join(f'{column} {gap:.3g}' for column, gap in gaps.items())}."
        for name, gaps in fit.rms(best).items()
    ]


def _listed(matrix: Array) -> list[list[float | None]]:
    """Return a matrix as lists, with None for what is infinite."""
    return [[float(x) if np.isfinite(x) else None for x in row] for row in matrix]


def _parameter_table(parameters: Sequence[Fitted], best: Array, known: Certainty) -> str:
    lines = StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    writer.writerow(["parameter", "value", "start", "lower", "upper", "scale", "deviation_over_bounds"])
    for p, z, deviation in zip(parameters, best, known.deviations, strict=True):
        writer.writerow([p.name, repr(_from_unit(p, z)), p.start, p.lower, p.upper, p.scale, f"{deviation:.4g}"])
    return lines.getvalue()
