"""True-colour pictures as PNG files (ISO/IEC 15948)."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

SIGNATURE: Final = b"\x89PNG\r\n\x1a\n"
TRUE_COLOUR: Final = 2
FILTER_UP: Final = 2  # a byte is stored as its difference from the one above, which suits a smooth surface


def png_from_rgb(rgb: NDArray[np.uint8]) -> bytes:
    """A picture of 8-bit colours, uint8 (rows, columns, 3), as a PNG file."""
    rows, columns, _ = rgb.shape
    lines = np.empty((rows, 1 + 3 * columns), np.uint8)
    lines[:, 0] = FILTER_UP
    lines[:, 1:] = np.diff(rgb.reshape(rows, -1), axis=0, prepend=np.uint8(0))
    header = struct.pack(">IIBBBBB", columns, rows, 8, TRUE_COLOUR, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(lines.tobytes(), 6)), (b"IEND", b""))
    return SIGNATURE + b"".join(_chunk(kind, content) for kind, content in chunks)


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
