"""What each of several workers may take of what the settings give to a service."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from app.settings import Settings


def settings_of_worker(settings: Settings) -> Settings:
    """Settings of one worker: threads and caches by default are those of the machine, divided by the workers.

    What is set explicitly holds for each worker.
    """
    count = settings.workers
    shares: dict[str, Any] = {
        "search_threads": max(settings.search_threads // count, 1),
        "cache_limit_bytes": settings.cache_limit_bytes // count,
    }
    return settings.model_copy(
        update={name: share for name, share in shares.items() if name not in settings.model_fields_set}
    )
