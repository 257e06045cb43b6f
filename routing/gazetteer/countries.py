"""Names of countries, for maps that have no boundary of theirs: the local one, then the English one."""

from __future__ import annotations

from typing import Final

_TABLE: Final = """
ad Andorra; ae الإمارات العربية المتحدة, United Arab Emirates; al Shqipëria, Albania; am Հայաստան, Armenia
ar Argentina; at Österreich, Austria; au Australia; az Azərbaycan, Azerbaijan
ba Bosna i Hercegovina, Bosnia and Herzegovina
be België, Belgium; bg България, Bulgaria; bo Bolivia; br Brasil, Brazil
by Беларусь, Belarus; ca Canada
ch Schweiz, Switzerland; cl Chile; cn 中国, China; co Colombia; cr Costa Rica; cy Κύπρος, Cyprus; cz Česko, Czechia
de Deutschland, Germany; dk Danmark, Denmark; ec Ecuador; ee Eesti, Estonia; eg مصر, Egypt; es España, Spain
fi Suomi, Finland; fr France; gb United Kingdom; ge საქართველო, Georgia; gr Ελλάδα, Greece; hr Hrvatska, Croatia
hu Magyarország, Hungary; id Indonesia; ie Ireland; il ישראל, Israel; in India; is Ísland, Iceland; it Italia, Italy
jo الأردن, Jordan; jp 日本, Japan; ke Kenya; kr 대한민국, South Korea; kz Қазақстан, Kazakhstan; li Liechtenstein
lt Lietuva, Lithuania; lu Luxembourg; lv Latvija, Latvia; ma المغرب, Morocco; mc Monaco; md Moldova
me Crna Gora, Montenegro; mk Северна Македонија, North Macedonia; mt Malta; mx México, Mexico; my Malaysia
ng Nigeria; nl Nederland, Netherlands; no Norge, Norway; nz New Zealand; pa Panamá, Panama; pe Perú, Peru
ph Pilipinas, Philippines; pl Polska, Poland; pt Portugal; py Paraguay; ro România, Romania; rs Србија, Serbia
ru Россия, Russia; sa السعودية, Saudi Arabia; se Sverige, Sweden; sg Singapore; si Slovenija, Slovenia
sk Slovensko, Slovakia; sm San Marino; th ประเทศไทย, Thailand; tn تونس, Tunisia; tr Türkiye, Turkey; tw 臺灣, Taiwan
ua Україна, Ukraine; us United States; uy Uruguay; ve Venezuela; vn Việt Nam, Vietnam; xk Kosova, Kosovo
za South Africa
"""
COUNTRIES: Final = {
    entry.strip()[:2]: tuple(name.strip() for name in entry.strip()[2:].split(","))
    for entry in _TABLE.replace("\n", ";").split(";")
    if entry.strip()
}


def country_names(code: str) -> dict[str, str]:
    """Names of a country by its code in small letters, "" for the local one; none of one that is not known here."""
    names = COUNTRIES.get(code, ())
    return {"": names[0], "en": names[-1]} if names else {}
