"""Heights filled in where a drive recorded none."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from diagnosis.recordings.notes import Note, NoteKind
from diagnosis.recordings.recording import Detail

if TYPE_CHECKING:
    from collections.abc import Sequence

    from diagnosis.heights.sources import HeightSource, LookedUp, Progress
    from diagnosis.heights.way import SampleHeights
    from diagnosis.recordings.recording import Recording

LEAST_KNOWN_FRAC: Final = 0.95  # of a drive's way, so that what is bridged hardly matters
MOST_OFF_ROAD_FRAC: Final = 0.3  # of its places: more is not bridges and tunnels, but another place or datum


def with_heights(
    recordings: Sequence[Recording], sources: Sequence[HeightSource], progress: Progress | None = None
) -> list[Recording]:
    """The recordings, those without height filled in from the first source that knows LEAST_KNOWN_FRAC of their way.

    A note on each says from what, or why not. Sums of drives, which have no positions, stay as they are. progress:
    called with the share that is done. Raises what reading a source raises.
    """
    found = list(recordings)
    for done, source in enumerate(sources):

        def on_share(share: float, done: int = done) -> None:
            if progress is not None:
                progress((done + share) / len(sources))

        open_ = [k for k, recording in enumerate(found) if recording.elevation_m is None and _is_driven(recording)]
        if open_:
            looked_up = source.look_up([found[k] for k in open_], on_share)
            for k, heights in zip(open_, looked_up, strict=True):
                found[k] = _filled(found[k], source.name, heights)
    return found


def _is_driven(recording: Recording) -> bool:
    return recording.detail is not Detail.TOTALS


def _filled(recording: Recording, name: str, found: LookedUp) -> Recording:
    why_not = found.why_not or _not_enough(found.heights)
    if found.heights is None or why_not:
        note = Note(NoteKind.MISSING, "elevation_m", f"not filled in from {name}: {why_not}")
        return replace(recording, notes=(*recording.notes, note))
    heights = found.heights
    text = f"filled in from {name}, {found.how}; {heights.known_frac:.0%} of its way is on it"
    if heights.off_road_frac > 0.0:
        text += f", of which {heights.off_road_frac:.1%} are bridged, too steep for a road"
    note = Note(NoteKind.FILLED, "elevation_m", text)
    return replace(recording, elevation_m=heights.height_m, elevation_source=name, notes=(*recording.notes, note))


def _not_enough(heights: SampleHeights | None) -> str:
    """Why heights are not those of a drive; nothing where they are."""
    known_frac = 0.0 if heights is None else heights.known_frac
    if heights is None or known_frac < LEAST_KNOWN_FRAC:
        return f"{known_frac:.0%} of its way is on it, {LEAST_KNOWN_FRAC:.0%} are needed"
    if heights.off_road_frac > MOST_OFF_ROAD_FRAC:
        return f"{heights.off_road_frac:.0%} of its way would be too steep for a road, at most {MOST_OFF_ROAD_FRAC:.0%}"
    return ""
