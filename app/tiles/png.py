"""True-colour pictures as PNG files."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING

from PIL import Image

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def png_from_rgb(rgb: NDArray[np.uint8]) -> bytes:
    """A picture of 8-bit colours, uint8 (rows, columns, 3), as a PNG file."""
    file = BytesIO()
    Image.fromarray(rgb).save(file, "png")
    return file.getvalue()
