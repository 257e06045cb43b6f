"""The faults that were found in the service by measuring it, in their order; tests name them by their keys."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Fault:
    """What was done to the service, and what came of it before."""

    done: str
    before: str


FAULTS: Final = {
    "refused-uploads": Fault(
        "20 refused gzip recordings of 140 kB",
        "worker at 7.8 GB: kept errors hold their traceback, and with it the tables",
    ),
    "decoded-size": Fault("Parquet of 217 kB: one long text, dictionary-encoded, 500,000 rows", "5.1 GB"),
    "patterns": Fault(
        '`{"recordings": ["**/**/…×60/x.csv"]}`, 45 times, sockets closed',
        "service unreachable, SIGTERM without effect; eight such keep 1.2 cores busy",
    ),
    "half-sent-headers": Fault("1,200 half-sent headers at a limit of 1,024 descriptors", "unreachable, 156 MB of log"),
    "graph-cut": Fault("graph file cut under a running service (`cp` over it)", "SIGBUS, process gone, nothing logged"),
    "graph-changed": Fault(
        "any array of a graph shuffled or one bit flipped within its range", "loaded; other answers in up to 13 of 13"
    ),
    "half-sent-body": Fault("SIGTERM with a half-sent body", "never ends"),
    "unknown-keys": Fault("300,000 unknown keys in a body, two clients", "`/healthz` 1.7 to 3.8 s"),
    "matrices": Fault(
        "16 matrices of 100 × 100 at once",
        "0 of 16 answered, short requests 14 s; work goes on after the client has gone",
    ),
    "many-clients": Fault("64 and 256 clients, mixed", "121 and 109 requests a second, short ones 0.6 and 2.3 s"),
    "long-search": Fault(
        "fastest route of 400 km that the charge does not reach, a million links",
        "up to 104 s for one query, over the time limit of 30 s, uninterruptible",
    ),
    "crowded-search": Fault(
        "route of a lorry with losses by the square of the force, battery full, tyres cold",
        "no answer within minutes, uninterruptible",
    ),
    "memory": Fault("random vehicles and weather on five graphs", "7.3 kB a link kept: 2.4 GB for 267,000 links"),
    "database-gone": Fault("database file gone", "made anew and empty without a word"),
    "database-encoding": Fault("SQL_ASCII cluster", "no start"),
    "disk-full": Fault("full disk at upload", "500"),
    "foreign-page": Fault("foreign page posts a form", "accepted"),
    "any-host": Fault("any Host", "accepted"),
}
