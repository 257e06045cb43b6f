"""What maps, charts and pickers show of diagnoses: verdict in a sentence, residuals, trips along time."""

from __future__ import annotations

import json

import sqlalchemy as sa
from alembic import op

revision: str = "0003"
down_revision: str | None = "0002"

COLUMNS = (
    ("recordings", sa.Integer()),
    ("verdict", sa.String(40)),
    ("text", sa.Text()),
    ("warnings", sa.Text()),
    ("residuals", sa.Text()),
)


def upgrade() -> None:
    """Make columns and table, and fill in what stored results say."""
    for name, kind in COLUMNS:
        op.add_column("diagnoses", sa.Column(name, kind, nullable=True))
    op.create_table(
        "diagnosis_trips",
        sa.Column("diagnosis", sa.String(100), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("trip", sa.Text(), nullable=False),
        sa.Column("outline", sa.Text(), nullable=False),
        sa.Column("timeline", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("diagnosis", "position"),
    )
    _fill_in()


def downgrade() -> None:
    """Drop columns and table."""
    op.drop_table("diagnosis_trips")
    for name, _ in reversed(COLUMNS):
        op.drop_column("diagnoses", name)


def _fill_in() -> None:
    """Verdict and first sentence of results that are stored already; a damaged one is left without."""
    table = sa.table("diagnoses", *(sa.column(name) for name in ("id", "result", "verdict", "text")))
    connection = op.get_bind()
    ids = connection.execute(sa.select(table.c.id).where(table.c.result.is_not(None))).scalars().all()
    for diagnosis_id in ids:
        result = connection.execute(sa.select(table.c.result).where(table.c.id == diagnosis_id)).scalar_one()
        headline = _headline(result)
        if headline is not None:
            values = {"verdict": headline[0], "text": headline[1]}
            connection.execute(sa.update(table).where(table.c.id == diagnosis_id).values(**values))


def _headline(result: str) -> tuple[str, str] | None:
    """Verdict and the first thing that was concluded; None where the result can't be read."""
    try:
        document = json.loads(result)
        concluded = [*document["findings"], *document["parameter_errors"], *document["unexplained"]]
        verdict, text = document["verdict"], concluded[0]["text"] if concluded else document["text"]
    except (ValueError, KeyError, TypeError, IndexError, RecursionError):
        return None
    return (verdict[:40], text) if isinstance(verdict, str) and isinstance(text, str) else None
