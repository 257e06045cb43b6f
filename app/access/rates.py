"""How much one client may ask for: so many units a second and a day."""

from __future__ import annotations

import time
from collections import OrderedDict
from dataclasses import dataclass
from typing import Final

from app.access.errors import RateLimitedError

DAY_S: Final = 86_400.0
MOST_CLIENTS: Final = 10_000  # that are remembered; who asked longest ago is forgotten first


@dataclass(slots=True)
class _Account:
    left: float
    seen_s: float
    day: int
    used: float


class RateLimits:
    """A bucket of units for each client, which fills with time, and what each has used today (UTC).

    per_s: units that flow in, 0 for no limit. burst: what a bucket holds. daily_quota: 0 for none.
    """

    def __init__(self, per_s: float, burst: float, daily_quota: float, most_clients: int = MOST_CLIENTS) -> None:
        self.per_s = per_s
        self.burst = burst
        self.daily_quota = daily_quota
        self._most = most_clients
        self._accounts: OrderedDict[str, _Account] = OrderedDict()

    def __len__(self) -> int:
        return len(self._accounts)

    def take(self, client: str, units: float, daily_quota: float | None = None, now_s: float | None = None) -> None:
        """Take units for a client; raises RateLimitedError, and takes none, where there are not as many.

        daily_quota: of this client, in place of that of all. now_s: seconds since 1970, by default now.
        """
        quota = self.daily_quota if daily_quota is None else daily_quota
        if not self.per_s and not quota:
            return
        now = time.time() if now_s is None else now_s
        account = self._account(client, now)
        if quota and account.used + units > quota:
            raise RateLimitedError(f"{quota:g} units a day", DAY_S - now % DAY_S)
        if self.per_s:
            if account.left < units:
                raise RateLimitedError(
                    f"{self.per_s:g} units a second and {self.burst:g} at once", (units - account.left) / self.per_s
                )
            account.left -= units
        account.used += units

    def _account(self, client: str, now: float) -> _Account:
        day = int(now // DAY_S)
        account = self._accounts.get(client)
        if account is None:
            account = self._accounts[client] = _Account(self.burst, now, day, 0.0)
            if len(self._accounts) > self._most:
                self._accounts.popitem(last=False)
            return account
        self._accounts.move_to_end(client)
        account.left = min(account.left + max(now - account.seen_s, 0.0) * self.per_s, self.burst)
        account.seen_s = now
        if day != account.day:
            account.day, account.used = day, 0.0
        return account
