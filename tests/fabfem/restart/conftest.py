"""The tests of restart share their scenes and their way of killing a run with `tests/benchmarks/restart.py`."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent))
