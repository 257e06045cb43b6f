"""Databases brought to a revision of their tables."""

from __future__ import annotations

from alembic import command
from alembic.config import Config
from sqlalchemy import create_engine

from app.store.database import MIGRATIONS, driver_url


def to_revision(url: str, revision: str, *, down: bool = False) -> None:
    """Bring the tables of a database to a revision."""
    engine = create_engine(driver_url(url))
    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS))
    config.set_main_option("path_separator", "os")
    with engine.begin() as connection:
        config.attributes["connection"] = connection
        (command.downgrade if down else command.upgrade)(config, revision)
    engine.dispose()
