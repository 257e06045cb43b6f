"""Answers with no more than is asked for: chosen parts, few digits, short lines."""
