"""Prices in the words of stations: numbers where every word of them is understood, else the words alone."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Final

from routing.stations.formats.numbers import number_of
from routing.stations.station import Price

REPEATED: Final = 2000  # texts of a file, most of which come again
MOST_TEXT: Final = 300  # letters that are kept
MOST_PARSED: Final = 120  # letters that are read
MOST_PRICE: Final = 1e5  # of any unit in any currency
FREE: Final = re.compile(
    r"(?:free(?: of charge| charging| to use| charge)?|no (?:charge|cost|fee)|complimentary|gratis|kostenlos|kostenfrei"
    r"|gratuit(?:e|o)?|maksuton|ilmainen|zdarma|bezpłatn[ey]|0(?:[.,]00?)? ?(?:€|eur|usd|gbp|[$£])|[€$£] ?0"
    r"(?:[.,]00?)?)[.!]?",
    re.IGNORECASE,
)
PARTS: Final = re.compile(r"\s*(?:[;+\n|]|,\s|\s(?:and|und|plus|et|y|e)\s)\s*", re.IGNORECASE)
SIGNS: Final = {"€": "EUR", "£": "GBP", "zł": "PLN", "₣": "CHF", "₹": "INR", "¥": "JPY", "₪": "ILS", "fr.": "CHF"}
CODES: Final = frozenset(
    (
        *("EUR", "USD", "GBP", "CHF", "SEK", "NOK", "DKK", "PLN", "CZK", "HUF", "RON", "BGN", "HRK", "ISK", "TRY"),
        *("ILS", "CAD", "AUD", "NZD", "JPY", "CNY", "KRW", "INR", "ZAR", "BRL", "MXN"),
    )
)
DOLLARS: Final = {"US": "USD", "CA": "CAD", "AU": "AUD", "NZ": "NZD"}  # by ISO 3166 codes
CROWNS: Final = {"NO": "NOK", "SE": "SEK", "DK": "DKK", "IS": "ISK"}
HUNDREDTHS: Final = {
    "ct": "EUR",
    "cts": "EUR",
    "cent": "",
    "cents": "",
    "c": "",
    "¢": "USD",
    "p": "GBP",
    "pence": "GBP",
}
PER_KWH: Final = frozenset(("kwh", "kw/h", "kw h", "kw-h"))
MINUTES: Final = {"min": 1.0, "mins": 1.0, "minute": 1.0, "minuten": 1.0, "m": 1.0, "h": 60.0, "hr": 60.0, "hour": 60.0}
MINUTES_MORE: Final = {"std": 60.0, "stunde": 60.0, "heure": 60.0, "hora": 60.0, "ora": 60.0, "hrs": 60.0}
SESSIONS: Final = frozenset(
    (
        *("session", "session fee", "charge", "charging session", "connection", "connection fee", "start", "start fee"),
        *(
            "starting fee",
            "transaction",
            "visit",
            "use",
            "startgebühr",
            "ladevorgang",
            "vorgang",
            "recharge",
            "plug in",
        ),
    )
)
MONEY: Final = r"€|£|\$|¢|zł|₹|¥|₪|kr\.?|fr\.|(?!(?:per|pro|par|por|je|al|a)\b)[a-z]{1,5}"
NUMBER: Final = r"\d{1,6}(?:[.,]\d{1,4})?|[.,]\d{1,4}"
PART: Final = re.compile(
    rf"(?P<before>{MONEY})?\s*(?P<number>{NUMBER})\s*(?P<after>{MONEY})?\s*(?:(?:/|per|pro|je|a|par|por|al)\s*)?"
    r"(?P<unit>[a-zäöüéè][a-zäöüéè /-]{0,18})",
    re.IGNORECASE,
)


@lru_cache(maxsize=REPEATED)
def price_of(text: str, country: str = "") -> tuple[Price | None, bool | None]:
    """What charging costs, and whether it costs anything; None where the words don't say.

    country: ISO 3166 code that tells one dollar or crown from the other. Numbers are read only where each part, as in
    "0,39 €/kWh + 1 € session fee", is understood, in one currency, no unit twice; ranges and conditions are kept as
    words.
    """
    kept = " ".join("".join(letter if letter.isprintable() else " " for letter in text[:MOST_TEXT]).split())
    if not kept:
        return None, None
    if FREE.fullmatch(kept):
        return Price(text=kept, per_kwh=0.0), False
    parsed = _parsed(kept, country.upper()) if len(kept) <= MOST_PARSED else None
    if parsed is None:
        return Price(text=kept), None
    currency, rates = parsed
    price = Price(kept, currency, rates.get("kwh"), rates.get("min"), rates.get("session"))
    return price, any(rate > 0.0 for rate in rates.values())


def _parsed(text: str, country: str) -> tuple[str, dict[str, float]] | None:
    """Currency and rates of a price of which every part is understood."""
    rates: dict[str, float] = {}
    currencies: set[str] = set()
    for part in PARTS.split(text.rstrip(" .;,")):
        match = PART.fullmatch(part)
        money = None if match is None else _money(match["before"], match["after"], country)
        if match is None or money is None:
            return None
        unit = _unit(match["unit"].strip().lower().rstrip("."))
        number = number_of(match["number"].replace(",", "."))
        if unit is None or number is None or number > MOST_PRICE or unit[0] in rates:
            return None
        rates[unit[0]] = round(number * money[1] / unit[1], 8)
        currencies.add(money[0])
    return (currencies.pop(), rates) if len(currencies) == 1 else None


def _money(before: str | None, after: str | None, country: str) -> tuple[str, float] | None:
    """The currency of signs before or behind a number, and the share of it that the number counts."""
    if (before is None) == (after is None):
        return None
    sign = (before or after or "").lower().rstrip(".")
    if before is not None and sign in HUNDREDTHS:
        return None
    if sign in HUNDREDTHS:
        currency = HUNDREDTHS[sign] or ({"US": "USD", "CA": "CAD", "AU": "AUD", "NZ": "NZD"}.get(country, ""))
        return (currency, 0.01) if currency else None
    if sign in ("$", "kr"):
        known = (DOLLARS if sign == "$" else CROWNS).get(country)
        return None if known is None else (known, 1.0)
    currency = SIGNS.get(sign) or ("EUR" if sign in ("euro", "euros") else sign.upper())
    return (currency, 1.0) if currency in CODES else None


def _unit(unit: str) -> tuple[str, float] | None:
    """What a rate is for, and how many of the unit that it is kept in; None where it is unknown."""
    if unit in PER_KWH:
        return "kwh", 1.0
    if unit in SESSIONS:
        return "session", 1.0
    minutes = MINUTES.get(unit) or MINUTES_MORE.get(unit)
    return None if minutes is None else ("min", minutes)
