"""Commands that run a case many times, or many cases: sweep, study, calibrate and gallery."""

import argparse
from pathlib import Path

from fabfem.commands.status import DONE, INTERRUPTED, STOPPED, fail

ENDED_EARLY = "interrupted; runs that ended are kept, and the same command goes on from there"


def add_commands(commands: argparse._SubParsersAction, common: argparse.ArgumentParser) -> None:
    """Add the commands to those of a parser."""
    many = {
        "sweep": (_sweep, "run a case with the product of some parameters"),
        "study": (_study, "error against run time for the settings of a case"),
        "calibrate": (_calibrate, "fit parameters of a case to measured curves"),
    }
    for name, (command, what) in many.items():
        runs = commands.add_parser(name, parents=[common], help=what)
        runs.add_argument("case", type=Path, metavar="CASE.toml")
        place = f"folder of the results (default: results/CASE_{name})"
        runs.add_argument("--out", type=Path, metavar="DIR", help=place)
        runs.set_defaults(command=command)
    keep = "keep the error of the case's own settings beside it, for solve to say"
    commands.choices["study"].add_argument("--keep", action="store_true", help=keep)

    gallery = commands.add_parser("gallery", parents=[common], help="run and draw all cases of a folder")
    which = "folder of cases, or its name in cases: element, ..."
    gallery.add_argument("cases", type=Path, metavar="FOLDER", help=which)
    place = "folder of the results (default: results/gallery/FOLDER)"
    gallery.add_argument("--out", type=Path, metavar="DIR", help=place)
    gallery.add_argument("--pictures", type=Path, metavar="DIR", help="folder that gets a copy of every picture")
    gallery.set_defaults(command=_gallery)


def _folder(options: argparse.Namespace, what: str) -> Path:
    """Return where the results of many runs of a case go."""
    return options.out or Path("results") / f"{options.case.stem}_{what}"


def _sweep(options: argparse.Namespace) -> int:
    from fabfem.study.sweep import sweep

    swept = sweep(options.case, _folder(options, "sweep"), options.quiet)
    from fabfem.pictures.sweep import draw

    pictures = draw(swept.folder)
    if not options.quiet:
        counted = f"{swept.completed} of {swept.runs} runs completed"
        print(counted, *(f"  {file}" for file in (swept.table, *pictures)), sep="\n")
    return DONE if swept.completed == swept.runs else STOPPED


def _study(options: argparse.Namespace) -> int:
    from fabfem.pictures.work_precision import draw
    from fabfem.study.work_precision import study

    try:
        found = study(options.case, _folder(options, "study"), options.quiet)
    except KeyboardInterrupt:
        return fail(ENDED_EARLY, INTERRUPTED)
    files = [found.folder / "study.csv", draw(found.folder)]
    if options.keep:
        from fabfem.case import read_case
        from fabfem.study.accuracy import keep

        files.append(keep(read_case(options.case), found.folder))
    if not options.quiet:
        print(*found.sentences, *(f"  {file}" for file in files), sep="\n")
    return DONE


def _calibrate(options: argparse.Namespace) -> int:
    from fabfem.pictures.calibration import draw
    from fabfem.study.calibrate import calibrate

    try:
        found = calibrate(options.case, _folder(options, "calibrate"), options.quiet)
    except KeyboardInterrupt:
        return fail(ENDED_EARLY, INTERRUPTED)
    picture = draw(found.folder)
    if not options.quiet:
        print(*found.sentences, f"  {found.folder / 'calibration.json'}", f"  {picture}", sep="\n")
    return DONE


def _gallery(options: argparse.Namespace) -> int:
    from fabfem.gallery import RIGHT, case_files, gallery

    files = case_files(options.cases)
    folder = options.out or Path("results") / "gallery" / files[0].parent.name
    shown = gallery(files, folder, options.quiet, options.pictures)
    return DONE if all(one.status == RIGHT for one in shown) else STOPPED
