"""The machine that a benchmark ran on, and the memory of a process."""

from __future__ import annotations

import os
import platform
import resource
import sys
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np


@dataclass(frozen=True, slots=True)
class Machine:
    """What the figures depend on besides the code; load is of the last minute, cores are those this process may use."""

    cpu: str
    cores: int
    memory_gb: float
    python: str
    numpy: str
    numba: str
    load: float


def this_machine() -> Machine:
    """The machine this process runs on."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    memory_gb = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    return Machine(
        _cpu_model(), cores, memory_gb, platform.python_version(), np.__version__, numba.__version__, os.getloadavg()[0]
    )


def _cpu_model() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    for line in lines:
        key, _, value = line.partition(":")
        if key.strip() == "model name":
            return value.strip()
    return platform.processor() or platform.machine()


def peak_memory_mb() -> float:
    """Most memory this process has held resident [MB].

    VmHWM where the system has it: after fork and exec, ru_maxrss still counts what the parent held.
    """
    peak_kib = _status_kib("VmHWM")
    if peak_kib is None:
        peak_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024 if sys.platform == "darwin" else 1)
    return peak_kib * 1024 / 1e6


def resident_memory_mb() -> float | None:
    """Memory this process holds resident now, shared file pages included [MB]; None where the system does not say."""
    resident_kib = _status_kib("VmRSS")
    return None if resident_kib is None else resident_kib * 1024 / 1e6


def private_memory_mb() -> float | None:
    """Memory this process holds resident that no file backs [MB]; None where the system does not say."""
    private_kib = _status_kib("RssAnon")
    return None if private_kib is None else private_kib * 1024 / 1e6


def _status_kib(key: str) -> float | None:
    try:
        lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    except OSError:
        return None
    for line in lines:
        name, _, value = line.partition(":")
        if name == key:
            return float(value.split()[0])
    return None
