"""Fabric evolution laws, one file each; a new file here is a new law (see `law`)."""

from .constant import Constant
from .law import fabric_increment, known_laws
from .zhao_kruyt import ZhaoKruyt

__all__ = ["Constant", "ZhaoKruyt", "fabric_increment", "known_laws"]
