"""Style sheet of the report: light, dark and paper, and colours of the plots by class.

Families have the colours of Okabe and Ito's set and darker or lighter kin of them; text on the page keeps a contrast of
at least 4.5 to 1 (WCAG 2.2, 1.4.3), marks 3 to 1 (1.4.11).
"""

from __future__ import annotations

from typing import Final

CSS: Final = """
:root {
  color-scheme: light dark;
  --paper: #ffffff; --panel: #f5f7f8; --ink: #1c2429; --soft: #55626b; --rule: #d5dbdf; --grid: #e4e8eb;
  --before: #b4530a; --after: #1464ad; --measured: #6a757d; --speed: #6a757d;
  --thermal: #c8501c; --rolling: #1f6fb2; --aerodynamic: #2d93c4; --wind: #0f8a68; --mass: #b45c93; --grade: #85692f;
  --drivetrain: #7550a8; --recuperation: #4c8a2c; --battery: #a88400; --auxiliary: #5d6f7a; --profile: #a33b52;
  --unexplained: #1c2429; --other: #78716c;
}
@media screen and (prefers-color-scheme: dark) {
  :root {
    --paper: #14191d; --panel: #1d2429; --ink: #e8edf0; --soft: #a5b1b9; --rule: #39434a; --grid: #2b343a;
    --before: #f0a050; --after: #6cb4f2; --measured: #94a1a9; --speed: #94a1a9;
    --thermal: #f0814e; --rolling: #5aa6e6; --aerodynamic: #7fd0f5; --wind: #35bf98; --mass: #e394c3;
    --grade: #c2a162; --drivetrain: #b08fe0; --recuperation: #86c462; --battery: #e0bd3a; --auxiliary: #9db0bb;
    --profile: #e07f93; --unexplained: #ffffff; --other: #a8a29e;
  }
}
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1rem 1rem 4rem; max-width: 60rem; background: var(--paper); color: var(--ink);
  font: 1rem/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", Arial, sans-serif;
  overflow-wrap: anywhere; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 1rem 0 .25rem; }
h2 { font-size: 1.3rem; line-height: 1.25; margin: 2.75rem 0 .5rem; padding-top: .75rem;
  border-top: 1px solid var(--rule); }
h3 { font-size: 1.05rem; margin: 1.5rem 0 .25rem; }
p, ul, dl { margin: .5rem 0; max-width: 46rem; }
a { color: var(--after); }
.soft, caption, figcaption, summary { color: var(--soft); }
.soft, figcaption { font-size: .92rem; }
.verdict { margin: 1.25rem 0; padding: 1rem 1.25rem; background: var(--panel); border-left: 5px solid var(--after);
  border-radius: 4px; }
.verdict p:first-of-type { font-size: 1.2rem; line-height: 1.45; }
.verdict h2 { border: 0; margin: 0; padding: 0; font-size: 1rem; color: var(--soft); }
nav ul { columns: 17rem; padding-left: 1.1rem; }
article { margin: 1.25rem 0; padding: .25rem 1.25rem 1rem; border: 1px solid var(--rule); border-radius: 6px; }
dl { display: grid; grid-template-columns: fit-content(14rem) 1fr; gap: .2rem 1.25rem; }
dt { color: var(--soft); } dd { margin: 0; }
code { font-size: .9em; }
.scroll { overflow-x: auto; margin: .75rem 0; }
table { border-collapse: collapse; font-size: .87rem; font-variant-numeric: tabular-nums; overflow-wrap: normal; }
caption { text-align: left; padding-bottom: .3rem; }
th, td { text-align: left; vertical-align: top; padding: .25rem .7rem .25rem 0; border-bottom: 1px solid var(--grid);
  font-weight: 400; max-width: 30rem; }
thead th { font-weight: 600; border-bottom-color: var(--rule); vertical-align: bottom; }
tfoot th, tfoot td { border-top: 1px solid var(--soft); font-weight: 600; }
tbody th { overflow-wrap: anywhere; min-width: 6rem; position: sticky; left: 0; background: var(--paper); }
.n { text-align: right; } td.n { white-space: nowrap; }
details { margin: .75rem 0; } summary { cursor: pointer; }
figure { margin: 1rem 0; }
.panels { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 18.5rem), 1fr)); gap: .75rem; }
.wide { overflow-x: auto; } .wide svg { min-width: 34rem; }
svg { display: block; width: 100%; height: auto; }
svg text { font-size: 12px; fill: var(--soft); } svg .title { font-size: 13px; font-weight: 600; fill: var(--ink); }
svg .label { fill: var(--soft); }
.grid { stroke: var(--grid); } .axis, .zero { stroke: var(--soft); }
.ideal { stroke: var(--soft); stroke-dasharray: 4 3; }
.line { fill: none; stroke-width: 2; stroke-linejoin: round; }
.line.measured { stroke: var(--measured); stroke-width: 3.5; }
.line.before { stroke: var(--before); stroke-dasharray: 5 3; stroke-width: 1.6; } .line.after { stroke: var(--after); }
.line.speed { stroke: var(--speed); stroke-width: 1.4; } .line.whisker { stroke-dasharray: none; stroke-width: 1.6; }
.held.before { fill: var(--before); } .held.after { fill: var(--after); } .held { stroke: var(--paper); }
.fitted { fill: var(--paper); stroke-width: 1.6; } .fitted.before { stroke: var(--before); }
.fitted.after { stroke: var(--after); }
.share { stroke: var(--paper); } .measured-mark { fill: var(--ink); stroke: var(--paper); }
.legend { display: flex; flex-wrap: wrap; gap: .2rem 1.25rem; list-style: none; padding: 0; font-size: .92rem; }
.legend svg { display: inline-block; width: 26px; height: 12px; margin-right: .35rem; vertical-align: -1px; }
FAMILIES
@media (max-width: 34rem) {
  dl { grid-template-columns: 1fr; gap: 0; } dd { margin-bottom: .5rem; } article { padding: .25rem .8rem .8rem; }
}
@media print {
  body { max-width: none; padding: 0; font-size: 10pt; }
  nav { display: none; }
  article, figure svg, tr { break-inside: avoid; } h2, h3 { break-after: avoid; }
  .scroll, .wide { overflow: visible; } table { font-size: 7.5pt; }
  tfoot { display: table-row-group; } th, td { padding-right: .4rem; }
  .share, .held, .fitted, .verdict { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
  details::details-content { content-visibility: visible; display: block; height: auto; }
}
""".replace(
    "FAMILIES",
    "\n".join(
        f".f-{name} {{ fill: var(--{name}); }}"
        for name in (
            *("thermal", "rolling", "aerodynamic", "wind", "mass", "grade", "drivetrain", "recuperation"),
            *("battery", "auxiliary", "profile", "unexplained", "other"),
        )
    ),
)
