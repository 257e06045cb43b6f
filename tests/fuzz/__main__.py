"""`python -m tests.fuzz SECONDS [FIRST_SEED]`: damaged files to every reader, until the time is up."""

from __future__ import annotations

import sys
import time
from collections import Counter
from pathlib import Path

from tests.fuzz.mutations import mutant
from tests.fuzz.processes import Reader
from tests.fuzz.samples import samples

KEPT = Path("fuzz-failures")


def main(seconds: float, first_seed: int) -> int:
    """Print counts by file, keep what failed under fuzz-failures; the exit status is 1 where something failed."""
    files = samples()
    counts = {name: Counter[str]() for name in files}
    shown: Counter[str] = Counter()
    reader = Reader()
    begin = time.monotonic()
    seed = first_seed
    while time.monotonic() - begin < seconds:
        for name, content in files.items():
            changed = mutant(content, name, seed)
            ending = reader.ending(name, changed)
            counts[name][ending.kind] += 1
            if ending.kind == "failed":
                where = "\n".join(ending.text.strip().splitlines()[-3:])
                shown[where] += 1
                if shown[where] == 1 or "Traceback" not in ending.text:  # a death doesn't say where it came from
                    KEPT.mkdir(exist_ok=True)
                    (KEPT / f"{seed}-{name}").write_bytes(changed)
                    print(f"{name}, seed {seed}:\n{ending.text}", flush=True)
        seed += 1
    reader.close()
    for name, count in counts.items():
        print(f"{name:16} read {count['read']:6} refused {count['refused']:6} failed {count['failed']:4}")
    total: Counter[str] = sum(counts.values(), Counter())
    print(f"{total.total()} files, seeds {first_seed}..{seed - 1}: {dict(total)}; {len(shown)} kinds of failure")
    return 1 if shown else 0


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0))
