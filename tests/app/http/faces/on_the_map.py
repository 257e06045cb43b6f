"""Places on the bundled map `highlands`, longitude and latitude [deg]."""

from __future__ import annotations

from typing import Final

ALSENWICK: Final = [-36.78, 44.44]
PASS_ROAD: Final = [-36.1817, 44.1088]
VALLEY_ROAD: Final = [-36.5098, 44.1957]
AT_SEA: Final = [0.0, 0.0]
ID4: Final = "ev:vw-id4@0.9"
