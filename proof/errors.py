"""Why a proof can't be run, or must not be believed."""

from __future__ import annotations

from diagnosis.errors import DiagnosisError


class ProofError(DiagnosisError):
    """A proof that can't be run: names what is missing or wrong, and what would help."""


class BrokenSealError(ProofError):
    """A label, a seed or the seal itself is not what was sealed before the tool ran."""
