"""The results on docs/proof.md, renewed from a finished proof: `python -m docs.proof_table DIR`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Final

from proof.telling import MARKDOWN_FILE

PAGE: Final = Path(__file__).resolve().parent / "proof.md"
BEGIN: Final = "<!-- proof -->\n"
END: Final = "<!-- /proof -->"


def with_results(page: str, results: str) -> str:
    """The page with its results renewed; raises ValueError where it does not have one place for them."""
    if page.count(BEGIN) != 1 or page.count(END) != 1 or page.index(BEGIN) > page.index(END):
        raise ValueError(f"the page does not have one place between {BEGIN.strip()} and {END}")
    before, rest = page.split(BEGIN)
    return f"{before}{BEGIN}\n{results.strip()}\n\n{END}{rest.split(END)[1]}"


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    found = (folder / MARKDOWN_FILE).read_text(encoding="utf-8")
    PAGE.write_text(with_results(PAGE.read_text(encoding="utf-8"), found), encoding="utf-8")
