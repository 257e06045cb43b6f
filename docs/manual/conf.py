"""How the manual is built from the pages of the repository: `python -m docs.manual`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pygments.lexers.special import TextLexer

from app import VERSION

if TYPE_CHECKING:
    from sphinx.application import Sphinx

project = "joulepath"
version = release = VERSION
html_title = "joulepath"
extensions = ["myst_parser"]
root_doc = "docs/index"
source_suffix = {".md": "markdown"}
include_patterns = [
    *("docs/*.md", "docs/adr/*.md", "docs/tutorials/*.md", "docs/reference/*.md"),
    *("data/graphs/README.md", "deploy/README.md", "CONTRIBUTING.md", "CHANGELOG.md", "README.md"),
]
myst_heading_anchors = 4
html_theme = "furo"
html_favicon = "../../web/icon.svg"
html_show_copyright = False
html_show_sphinx = False
html_copy_source = False


def setup(app: Sphinx) -> None:
    """Colour no table of numbers."""
    app.add_lexer("csv", TextLexer)
