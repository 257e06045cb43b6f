"""Synthetic regions: invented road networks on invented terrain, for demonstration and for measurements at scale."""

from routing.synth.region import synthesize

__all__ = ["synthesize"]
