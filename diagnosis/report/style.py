"""Style sheet of the report: light, dark and paper, and colours of the plots by class.

Families have the colours of Okabe and Ito's set and darker or lighter kin of them; text on the page keeps a contrast of
at least 4.5 to 1 (WCAG 2.2, 1.4.3), marks 3 to 1 (1.4.11).
"""

from __future__ import annotations

from typing import Final

from diagnosis.causes.families import Family
from diagnosis.report.rendering import rendered

OTHER_FAMILY: Final = "other"  # of families that the style sheet does not know
CSS: Final = rendered("style.css", families=(*(family.value for family in Family), OTHER_FAMILY))
