"""What was not recorded, and what can therefore not be told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from diagnosis.recordings.recording import Detail

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from diagnosis.recordings.reading import Recording


DECISIVE_FRAC: Final = 0.3  # of the drives, from which on a missing channel decides what can be told


@dataclass(frozen=True, slots=True)
class MissingChannel:
    """A channel that some of the fitted trips lack, and what that leaves open.

    decisive: whether so much hangs on it that the verdict begins with it.
    """

    channel: str
    trips: tuple[str, ...]
    text: str
    decisive: bool


@dataclass(frozen=True, slots=True)
class _Needed:
    channel: str
    name: str
    open_: str
    there: Callable[[Recording], bool]
    decisive: bool = False


NEEDED: Final = (
    _Needed(
        "speed_mps",
        "speed",
        "each drive is replayed at its mean speed, without stops and accelerations, and is one number",
        lambda recording: recording.detail is not Detail.TOTALS,
        decisive=True,
    ),
    _Needed(
        "power_w",
        "power",
        "each drive is one number, by its charge or a counter of energy, so that little more than heat and a"
        " constant draw is told",
        lambda recording: recording.detail not in (Detail.CHARGE, Detail.COUNTER),
        decisive=True,
    ),
    _Needed(
        "elevation_m",
        "height",
        "a grade of 1 % takes as much as the tyres do, so that rolling resistance, mass and what single trips have of"
        " their own cannot be told from hills",
        lambda recording: recording.elevation_m is not None,
        decisive=True,
    ),
    _Needed(
        "ambient_k",
        "temperature outside",
        "heat, cold tyres and dense air cannot be told from each other, nor from the vehicle's own numbers",
        lambda recording: recording.ambient_k is not None,
        decisive=True,
    ),
    _Needed(
        "voltage_v",
        "voltage",
        "losses of the battery cannot be told from those of the drive",
        lambda recording: recording.voltage_v is not None,
    ),
    _Needed(
        "latitude_deg",
        "position or heading",
        "wind, bends and what happens at a place cannot be seen",
        lambda recording: recording.latitude_deg is not None or recording.heading_rad is not None,
    ),
    _Needed(
        "payload_kg",
        "load",
        "the vehicle's mass is that of car and load as they mostly were",
        lambda recording: recording.payload_kg is not None,
    ),
)


def missing_channels(recordings: Sequence[Recording]) -> tuple[MissingChannel, ...]:
    """What trips lack of what a diagnosis can use, in the order of its weight."""
    found = []
    for needed in NEEDED:
        without = tuple(recording.id for recording in recordings if not needed.there(recording))
        if without:
            which = "any drive" if len(without) == len(recordings) else f"{len(without)} of {len(recordings)} drives"
            text = f"No {needed.name} was recorded on {which}: {needed.open_}."
            decisive = needed.decisive and len(without) >= DECISIVE_FRAC * len(recordings)
            found.append(MissingChannel(needed.channel, without, text, decisive))
    return tuple(found)


def filled_text(recordings: Sequence[Recording]) -> str:
    """That the height of trips was filled in, and from what; nothing where it was not."""
    filled = [recording.elevation_source for recording in recordings if recording.elevation_source]
    if not filled:
        return ""
    which = "all drives" if len(filled) == len(recordings) else f"{len(filled)} of {len(recordings)} drives"
    sources = " and ".join(dict.fromkeys(filled))
    return f"Height was filled in from {sources} on {which}; its grades err by about 1 %."
