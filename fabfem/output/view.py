"""``view.py``: the state in which ParaView first shows a result.

``paraview --script=DIR/view.py`` opens it, ``pvpython DIR/view.py PICTURE.png`` draws it. It finds the fields
beside itself, so a result can be moved; a state file of ParaView's own (``.pvsm``) would hold the path of the machine.
"""

from collections.abc import Sequence
from pathlib import Path

from fabfem.output.atomic import write_atomic

COLOURS = ("fabric_norm", "q", "p", "stress", "strain", "displacement")
"""Fields that the first view is coloured by, the first of them that is stored."""

SCRIPT = '''"""The fields of this folder in ParaView: paraview --script=view.py, or pvpython view.py PICTURE.png."""

import os
import sys

from paraview.simple import *

COLOUR, STRETCH = {colour!r}, 1.0  # field; factor on the displacement
here = os.path.dirname(os.path.abspath(__file__)) if "__file__" in globals() else {folder!r}

fields = PVDReader(registrationName={title!r}, FileName=os.path.join(here, "fields.pvd"))
fields.UpdatePipeline()
scene = GetAnimationScene()
scene.UpdateAnimationUsingDataTimeSteps()
scene.GoToLast()
view = GetActiveViewOrCreate("RenderView")
names = [fields.PointData.GetArray(k).Name for k in range(fields.PointData.GetNumberOfArrays())]
shown = fields
if "displacement" in names:
    Show(fields, view).SetRepresentationType("Outline")
    shown = WarpByVector(registrationName="deformed", Input=fields)
    shown.Vectors = ["POINTS", "displacement"]
    shown.ScaleFactor = STRETCH
display = Show(shown, view)
display.SetRepresentationType("Surface With Edges")
if COLOUR:
    ColorBy(display, ("POINTS" if COLOUR in names else "CELLS", COLOUR))
    display.RescaleTransferFunctionToDataRange(True, False)
    display.SetScalarBarVisibility(view, True)
bounds = fields.GetDataInformation().GetBounds()
view.CameraParallelProjection = 1
if bounds[4] == bounds[5]:
    view.InteractionMode = "2D"
time = AnnotateTimeFilter(registrationName="time", Input=fields)
Show(time, view)
view.ResetCamera()
Render(view)
if len(sys.argv) > 1 and sys.argv[-1].endswith(".png"):
    view.ViewSize = [1200, 800]
    SaveScreenshot(sys.argv[-1], view)
elif len(sys.argv) > 1 and sys.argv[-1].endswith(".pvsm"):
    SaveState(sys.argv[-1])
'''


def write_view(folder: Path, title: str, fields: Sequence[str]) -> None:
    """Write the script for a result that stores some fields."""
    colour = next((name for name in COLOURS if name in fields), next(iter(fields), ""))
    text = SCRIPT.format(colour=colour, folder=str(folder.resolve()), title=title or folder.name)
    write_atomic(folder / "view.py", text)
