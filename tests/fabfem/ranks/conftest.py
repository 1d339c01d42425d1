"""The tests of shared runs have their scenes beside them."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent))
