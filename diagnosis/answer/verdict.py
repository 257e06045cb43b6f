"""What all that was found comes to: a verdict, and one text that begins with what was not recorded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from diagnosis.answer.regimes import where
from diagnosis.answer.results import CapacityKind, Verdict

if TYPE_CHECKING:
    from collections.abc import Sequence

    from diagnosis.answer.missing import MissingChannel
    from diagnosis.answer.regimes import RegimeResidual
    from diagnosis.answer.results import CapacityEstimate, Finding, FitScore, ParameterError, Unexplained

FAR_FRAC: Final = 0.05  # error of trips that were left out, from which on something stays unexplained
OTHER_CAR_NUMBERS: Final = 3  # of the file, that drives of the same car do not contradict at once
OTHER_CAR_FRAC: Final = 0.15  # of energies, by which the file of the same car is not off where nothing is left out
OFF_FRAC: Final = 0.03  # of trips' energies, from which on a file's numbers are off
OFF_GAIN: Final = 0.5  # of that, that refitted numbers may leave
OTHER_CAR: Final = (
    "So much of the vehicle's file is contradicted that these drives may be of another vehicle, or the file may be"
    " wrong."
)


@dataclass(frozen=True, slots=True)
class Off:
    """How the vehicle's file and its own numbers refitted meet fitted trips: mean size of errors [-]."""

    nameplate: float
    before: float

    @property
    def clear(self) -> bool:
        """Whether the file's numbers are off, whichever of them it is."""
        return self.nameplate >= OFF_FRAC and self.before <= OFF_GAIN * self.nameplate

    def text(self) -> str:
        """That the numbers are off, whichever of them it is."""
        return (
            f"The vehicle's numbers are off: with those of its file trips err by {self.nameplate:.1%}, with fitted ones"
            f" by {self.before:.1%}. Which of them it is can't be told from these drives."
        )


def is_other_car(wrong: Sequence[ParameterError], off: Off | None) -> bool:
    """Whether so much of a file is contradicted that the drives may be of another vehicle."""
    far_off = off is not None and off.clear and off.nameplate >= OTHER_CAR_FRAC and len(wrong) != 1
    return far_off or any(error.at_bound for error in wrong) or len(wrong) >= OTHER_CAR_NUMBERS


@dataclass(frozen=True, slots=True)
class Rest:
    """What a diagnosis leaves: errors of trips that it has not seen, regimes that depart, channels that it lacked."""

    after: FitScore | None
    regimes: tuple[RegimeResidual, ...]
    lacking: tuple[MissingChannel, ...]
    trips: int
    held_out: bool
    other_car: bool
    doubts: str
    capacity: CapacityEstimate | None = None

    @property
    def is_far(self) -> bool:
        """Whether more is left than drives of a known car leave."""
        return self.after is not None and self.after.mape > FAR_FRAC

    def text(self) -> str:
        """What is left, and where most of it lies; nothing where little is."""
        if self.after is None or not self.is_far:
            return ""
        which = "Drives that were held out" if self.held_out else "Drives that the fit of the others had not seen"
        text = f"{which} are still missed by {self.after.mape:.1%} on average, which nothing here explains."
        departing = [regime for regime in self.regimes if regime.departs]
        if departing:
            most = max(departing, key=lambda regime: abs(regime.energy_kwh))
            text += f" Most of it lies {where(most)}: {most.mean_w:+.0f} W."
        return text


def verdict_of(
    found: Sequence[Finding],
    wrong: Sequence[ParameterError],
    strange: Sequence[Unexplained],
    off: Off | None,
    rest: Rest,
) -> tuple[Verdict, str]:
    """The verdict and everything that was concluded, in one text: what was not recorded first, what is left last."""
    as_a_whole = not (found or strange or wrong) and off is not None and off.clear
    text = " ".join(
        [
            *(lack.text for lack in rest.lacking if lack.decisive),
            *filter(None, [rest.doubts]),
            *([OTHER_CAR] if rest.other_car else []),
            *([off.text()] if as_a_whole and off is not None else []),
            *(
                finding.text
                if finding.separating_recording is None
                else f"{finding.text} {finding.separating_recording}"
                for finding in found
            ),
            *(error.text for error in wrong),
            *filter(None, [rest.capacity.text if rest.capacity is not None else ""]),
            *(structure.text for structure in strange),
            *filter(None, [rest.text()]),
        ]
    )
    if any(not finding.ambiguous_with for finding in found):
        return Verdict.LEFT_OUT_PHYSICS, text
    if found:
        return Verdict.CANNOT_TELL, text
    if strange:
        return Verdict.UNEXPLAINED, text
    if wrong:
        return Verdict.PARAMETER_ERROR, text
    if as_a_whole:
        return Verdict.PARAMETER_ERROR, text
    if rest.is_far:
        return Verdict.UNEXPLAINED, text
    if rest.capacity is not None and rest.capacity.kind is CapacityKind.LESS:
        return Verdict.PARAMETER_ERROR, text  # consumption is right, but ranges are not
    nothing = f"In {rest.trips} drives nothing stands out that the model leaves out."
    return Verdict.NOTHING_MISSING, f"{text} {nothing}".strip()
