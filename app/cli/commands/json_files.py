"""JSON that commands read: from a file, or from what is piped into them."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Final

from app.errors.raised import CommandError

STANDARD_INPUT: Final = Path("-")


def json_in(source: Path) -> object:
    """The JSON value in a UTF-8 file, or in the standard input where the source is `-`.

    Raises CommandError, in one line, where that is no such value: not UTF-8, not JSON, nested deeper than Python reads,
    or with a whole number of more digits than it reads; OSError where the file can't be read.
    """
    piped = source == STANDARD_INPUT
    name = "the input" if piped else str(source)
    content = sys.stdin.buffer.read() if piped else source.read_bytes()
    try:
        return json.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise CommandError(f"{name} is not UTF-8 at byte {error.start}") from error
    except json.JSONDecodeError as error:
        raise CommandError(f"{name} is not valid JSON: {error}") from error
    except RecursionError as error:
        raise CommandError(f"{name} is nested too deeply") from error
    except ValueError as error:  # what json raises on a long whole number
        limit = sys.get_int_max_str_digits()
        raise CommandError(f"{name} has a whole number of more than {limit} digits") from error
