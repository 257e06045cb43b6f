"""Ways between places: by searches of one weighting each, kept from plan to plan, and by comparing all of them."""

from __future__ import annotations

import math
import threading
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Final, TypeAlias, TypeVar

import numpy as np

from energy.units import JOULE_PER_KWH, SECOND_PER_HOUR
from routing.charging.exact import all_ways, all_ways_are_comparable
from routing.charging.stretches import along_way
from routing.charging.ways import Line, Pair, Way, profile_of, undominated
from routing.route.matrix import PathDrives
from routing.route.via import same_place
from routing.search.found import Limits, PathOptions
from routing.search.search import find_path, find_paths
from routing.search.search_back import search_back
from routing.search.space import potential_share
from routing.weights import ECO, FASTEST, Weights

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from routing.charging.stretches import AlongWay
    from routing.places import LinkPosition
    from routing.queries import RouteQuery
    from routing.route.best_path import RouteSearch
    from routing.search.found import FoundPath
    from routing.search.search_back import SearchBack
    from routing.search.space import SearchSpace

Answer = TypeVar("Answer")
Place: TypeAlias = "tuple[LinkPosition, ...]"  # on each direction of its road

FEW_TARGETS: Final = 12  # up to which searches directed to each of them take less than one to all
COMPARISON: Final = 100_000  # labels of a search that take about as long as comparing all ways of a pair
ROWS_KEPT: Final = 512  # of guesses from a place, of which a question has some tens
WAYS_KEPT: Final = 32  # whose stations along them are kept for a vehicle and its conditions
STAY: Final = Pair((Way(0.0, 0.0, 0.0, 0.0, 0.0),), (), math.inf)
NOWHERE: Final = Pair((), (), math.inf)


@dataclass(slots=True)
class LegCounts:
    """Work: searches that were run, pairs of which all ways were compared, pairs of places that were known before.

    labels: settled by searches; a comparison counts as COMPARISON of them.
    """

    searches: int = 0
    compared: int = 0
    known: int = 0
    labels: int = 0
    crowded: bool = False


class LegStore:
    """Pairs of places by vehicle, conditions and cap; one for a graph, safe between threads.

    All pairs of one vehicle under its conditions are dropped together where the graph's caches need room.
    """

    def __init__(self, search: RouteSearch) -> None:
        self.search = search
        self._pairs: dict[Hashable, dict[Place, dict[Place, Pair]]] = {}
        self._along: dict[Hashable, dict[Hashable, AlongWay]] = {}
        self._left_out: dict[Hashable, dict[Hashable, dict[Place, float]]] = {}
        self._rows: dict[Hashable, dict[Hashable, list[Pair]]] = {}
        self._held: dict[Hashable, int] = {}
        self._lock = threading.Lock()

    def known(self, space: Hashable, here: Place) -> dict[Place, Pair]:
        """Pairs from one place, a copy; space: what tells vehicle, conditions and cap from others."""
        with self._lock:
            return dict(self._pairs.get(space, {}).get(here, {}))

    def pair(self, space: Hashable, here: Place, there: Place) -> Pair | None:
        """The pair from one place to another, None where it is not known."""
        with self._lock:
            return self._pairs.get(space, {}).get(here, {}).get(there)

    def put(self, space: Hashable, pairs: Mapping[tuple[Place, Place], Pair]) -> None:
        """Keep pairs by both places; they count against the budget of the graph's caches."""
        with self._lock:
            froms = self._pairs.setdefault(space, {})
            more = 0
            for (here, there), pair in pairs.items():
                kept = froms.setdefault(here, {})
                before = kept.get(there)
                more += pair.held_bytes - (0 if before is None else before.held_bytes)
                kept[there] = pair
            self._held[space] = self._held.get(space, 0) + more
            self._rows.pop(space, None)
        self.search.budget.used(self, space, "legs", partial(self._held_bytes, space), partial(self._drop, space))

    def row(self, space: Hashable, question: Hashable) -> list[Pair] | None:
        """Pairs from a place as they were guessed since pairs were put last, None where they were not."""
        with self._lock:
            return self._rows.get(space, {}).get(question)

    def put_row(self, space: Hashable, question: Hashable, row: list[Pair]) -> None:
        """Keep pairs from a place, guesses among them, until pairs are put."""
        with self._lock:
            _put_latest(self._rows.setdefault(space, {}), question, row, ROWS_KEPT)

    def along(self, space: Hashable, question: Hashable) -> AlongWay | None:
        """Stations along a way, None where they are not known."""
        with self._lock:
            return self._along.get(space, {}).get(question)

    def put_along(self, space: Hashable, question: Hashable, along: AlongWay) -> None:
        """Keep stations along a way, the latest ones of a space."""
        with self._lock:
            _put_latest(self._along.setdefault(space, {}), question, along)

    def left_out(self, space: Hashable, question: Hashable) -> dict[Place, float]:
        """What ways over places that a search has left out cost at least, a copy."""
        with self._lock:
            return dict(self._left_out.get(space, {}).get(question, {}))

    def put_left_out(self, space: Hashable, question: Hashable, left_out: dict[Place, float]) -> None:
        """Keep what ways over places cost at least, of the latest searches of a space."""
        with self._lock:
            _put_latest(self._left_out.setdefault(space, {}), question, left_out)

    def _held_bytes(self, space: Hashable) -> int:
        along = sum(2 * way.least_there.nbytes for way in list(self._along.get(space, {}).values()))
        left_out = sum(100 * len(places) for places in list(self._left_out.get(space, {}).values()))
        rows = sum(sum(pair.held_bytes for pair in row) for row in list(self._rows.get(space, {}).values()))
        return self._held.get(space, 0) + along + left_out + rows

    def forget(self) -> None:
        """Give up all pairs."""
        self.search.budget.forget(self)

    def _drop(self, space: Hashable) -> None:
        with self._lock:
            self._pairs.pop(space, None)
            self._along.pop(space, None)
            self._left_out.pop(space, None)
            self._rows.pop(space, None)
            self._held.pop(space, None)


class LegFinder:
    """Ways of one query's vehicle under its conditions, which may hold a cap on its speed.

    weightings: of the searches from one place to others. Pairs are kept from plan to plan. Climate and tyres begin each
    leg as at a departure.
    """

    def __init__(
        self,
        store: LegStore,
        query: RouteQuery,
        weightings: Sequence[Weights],
        counts: LegCounts,
    ) -> None:
        self.space: SearchSpace = store.search.space_of(query, query.vehicle)
        self._store, self._query, self._weightings, self._counts = store, query, tuple(weightings), counts
        self._space_key = store.search.space_key(query, query.vehicle)

    @cached_property
    def _drives(self) -> PathDrives:
        return PathDrives(self._store.search.graph, self.space, self._query)

    def pairs(self, here: Place, there: Sequence[Place], weightings: Sequence[Weights] | None = None) -> list[Pair]:
        """Ways from one place to each of others, by some weightings at least, by default by all of the finder.

        Raises NegativeCycleError, SearchLimitError, TimeUpError.
        """
        known = self._store.known(self._space_key, here)
        places = list(dict.fromkeys(there))
        searches = self._counts.searches
        for weights in self._weightings if weightings is None else weightings:
            missing = [place for place in places if place not in known or not known[place].holds(weights)]
            if missing:
                made = self._searched(here, missing, weights, known)
                self._store.put(self._space_key, {(here, place): pair for place, pair in made.items()})
                known |= made
        if self._counts.searches == searches:
            self._counts.known += len(places)
        # what was dropped meanwhile to make room is searched again
        lost = [place for place in places if place not in known]
        if lost:
            known |= self._searched(here, lost, self._weightings[0], known)
        return [known[place] for place in there]

    def known_pairs(self, here: Place, there: Sequence[Place]) -> list[Pair | None]:
        """Ways from one place to each of others as far as they are known by the first weighting."""
        weights = self._weightings[0]
        pairs = [STAY if same_place(here, place) else self._store.pair(self._space_key, here, place) for place in there]
        return [pair if pair is not None and pair.holds(weights) else None for pair in pairs]

    def guessed(self, question: Hashable, guess: Callable[[], list[Pair]]) -> list[Pair]:
        """Pairs from a place as they are guessed from what is known, kept until more is known.

        question: what they depend on beside that.
        """
        row = self._store.row(self._space_key, question)
        if row is None:
            row = guess()
            self._store.put_row(self._space_key, question, row)
        return row

    def find_onward(self, here: Sequence[Place], there: Place, weightings: Sequence[Weights] | None = None) -> None:
        """Learn the best ways from each of many places to one of which no way is known by some weightings.

        here: the farthest first, to which the search back is led.
        """
        for weights in self._weightings if weightings is None else weightings:
            missing = self._unknown([(place, there) for place in here], weights)
            if missing:
                with self.search_back(weights, missing[0][0], there) as back:
                    self.learn_to(back, weights, here, there)

    def find_through(
        self, here: Place, spots: Sequence[Place], there: Place, weightings: Sequence[Weights] | None = None
    ) -> None:
        """Learn the best ways from a place to each of many and to a last one, and from each of them on to that.

        By searches that share one search back a weighting; where none directs them ways from the place are left out.
        """
        targets = [] if same_place(here, there) else [*spots, there]
        for weights in self._weightings if weightings is None else weightings:
            before = self._unknown([(here, target) for target in targets], weights)
            onward = self._unknown([(spot, there) for spot in spots], weights)
            if before or onward:
                with self.search_back(weights, here if before else onward[0][0], there) as back:
                    if before and back.is_directed:
                        missing = [target for _, target in before]
                        _, paths = back.on_the_way(here, missing, _never, lambda costs: range(costs.size))
                        self.learn(weights, {(here, target): paths.get(k) for k, target in enumerate(missing)})
                    self.learn_to(back, weights, spots, there)

    def find_over(
        self, weights: Weights, here: Place, spots: Sequence[Place], there: Place, most: float
    ) -> NDArray[np.float64]:
        """Learn the best ways from a place to another and to those of many over which ways there may cost so little.

        By one search that is led there. Returns what ways over those that were left out cost at least, float64 (n,),
        −inf for others, and for all where nothing leads a search.
        """
        question = weights, here, there
        left_out = self._store.left_out(self._space_key, question)
        unknown = self._unknown([(here, target) for target in (*spots, there)], weights)
        missing = [target for _, target in unknown if left_out.get(target, -math.inf) <= most]
        if missing and not same_place(here, there):
            left_out |= self._searched_over(weights, here, missing, there, most)
            self._store.put_left_out(self._space_key, question, left_out)
        unknown = self._unknown([(here, spot) for spot in spots], weights)
        over = {target: left_out.get(target, -math.inf) for _, target in unknown}
        return np.array([over.get(spot, -math.inf) for spot in spots])

    def _searched_over(
        self, weights: Weights, here: Place, missing: Sequence[Place], there: Place, most: float
    ) -> dict[Place, float]:
        """What ways over those that find_over leaves out cost at least; the best ways to the others are learnt."""
        met, least_left_out = there not in missing, math.inf

        def is_enough(k: int, _: float, via: float) -> bool:
            nonlocal met, least_left_out
            met |= missing[k] == there
            least_left_out = via if met and via > most else math.inf
            return least_left_out < math.inf

        with self.search_back(weights, here, there) as back:
            if not back.is_directed:
                return {}
            costs, paths = back.on_the_way(here, missing, is_enough, lambda costs: range(costs.size))
        found = [k for k, cost in enumerate(costs.tolist()) if cost < math.inf or least_left_out == math.inf]
        self.learn(weights, {(here, missing[k]): paths.get(k) for k in found})
        return {target: least_left_out for k, target in enumerate(missing) if k not in set(found)}

    @contextmanager
    def search_back(self, weights: Weights, led_to: Place, there: Place) -> Iterator[SearchBack]:
        """Searches to a place that share one search back, which is led to where the first of them begins."""
        search = self._store.search
        with search_back(self.space, search.pool, weights, led_to, there, search.label_limit) as back:
            self._counts.searches += 1
            yield back
            self._counts.crowded |= back.crowded

    def learn_to(self, back: SearchBack, weights: Weights, here: Sequence[Place], there: Place) -> None:
        """Learn the best ways by the weights of a search back from places to its own."""
        missing = self._unknown([(place, there) for place in here], weights)
        self.learn(weights, dict(zip(missing, back.paths([place for place, _ in missing]), strict=True)))

    def learn(self, weights: Weights, paths: Mapping[tuple[Place, Place], FoundPath | None]) -> None:
        """Keep the best ways by some weights between places, those that lead nowhere as well."""
        made = {}
        for places in self._unknown(list(paths), weights):
            before = self._store.pair(self._space_key, *places)
            made[places] = self._joined(before, weights, paths[places])
        if made:
            self._store.put(self._space_key, made)

    def add(self, here: Place, there: Place, path: FoundPath) -> None:
        """Keep a way between two places of which nothing is proven."""
        before = self._store.pair(self._space_key, here, there) or Pair((), ())
        if not same_place(here, there) and not any(np.array_equal(way.links, path.links) for way in before.ways):
            pair = replace(before, ways=undominated([*before.ways, self._way(path)]))
            self._store.put(self._space_key, {(here, there): pair})

    def _unknown(self, pairs: Sequence[tuple[Place, Place]], weights: Weights) -> list[tuple[Place, Place]]:
        """Those pairs of places of which no best way by some weights is known."""
        missing = []
        for here, there in dict.fromkeys(pairs):
            pair = self._store.pair(self._space_key, here, there)
            if (pair is None or not pair.holds(weights)) and not same_place(here, there):
                missing.append((here, there))
        return missing

    def along(
        self,
        weights: Weights,
        unit: float,
        ends: tuple[Place, Place],
        spots: Sequence[Place],
        slow: NDArray[np.float64],
        likely: Callable[[float], float],
    ) -> AlongWay | None:
        """Stations along a way as along_way tells them, kept from plan to plan; None where it has none to tell."""
        question = (weights, ends, tuple(spots), slow.tobytes(), likely(0.0), likely(1e12))
        found = self._store.along(self._space_key, question)
        if found is None:
            found = along_way(self, weights, unit, ends, spots, slow, likely)
            if found is not None:
                self._store.put_along(self._space_key, question, found)
        return found

    def climb_m(self, here: Place, there: Place) -> float:
        """How much higher a place is than another [m]."""
        low, high = self._heights_m([here, there]).tolist()
        return float(high - low)

    def _heights_m(self, places: Sequence[Place]) -> NDArray[np.float64]:
        g = self.space.arrays
        link = np.array([place[0].link_idx for place in places], np.int64)
        offset_m = np.array([place[0].offset_m for place in places])
        found: NDArray[np.float64] = g.tail_height_m[link] + g.grade_frac[link] * offset_m
        return found

    def least_costs(
        self,
        weights: Weights,
        first: Place,
        others: Callable[[float], Sequence[Place]],
        goal: Place,
        labels: tuple[int, int],
    ) -> NDArray[np.float64]:
        """No way from a first source and from others, given what is found for the first, to a place costs less.

        labels: after which the search from the first, and those from others, end. float64 (n,).
        """
        if weights.energy == weights.time == 0.0:
            return np.zeros(1 + len(others(0.0)))
        with search_back(self.space, self._store.search.pool, weights, first, goal) as back:
            least = back.least_costs([first], labels[0])
            return np.concatenate((least, back.least_costs(others(float(least[0])), labels[1])))

    def straight_costs(self, weights: Weights, places: Sequence[Place], there: Place) -> NDArray[np.float64]:
        """No way between places and another one costs less, by the straight line alone, but for what height stores."""
        costs, graph = self.space.lower_bound.costs(), self._store.search.graph
        at_m = costs.place_m[graph.tail[[place[0].link_idx for place in places]]]
        away_m = np.linalg.norm(at_m - costs.place_m[graph.tail[there[0].link_idx]], axis=1)
        aside_m = np.array([graph.length_m[place[0].link_idx] for place in (*places, there)])
        away_m = np.maximum(away_m - aside_m[:-1] - aside_m[-1], 0.0) * costs.line_to_road
        road_j, road_s, _ = costs.least_a_metre.tolist()
        found: NDArray[np.float64] = away_m * (
            weights.energy / JOULE_PER_KWH * road_j + weights.time / SECOND_PER_HOUR * road_s
        )
        return found

    def lift_costs(self, weights: Weights, here: Sequence[Place], there: Place) -> NDArray[np.float64]:
        """What height stores on ways from places to another one, as the search counts it, float64 (n,)."""
        physics = self.space.physics
        climbs_m = self._heights_m([there])[0] - self._heights_m(here)
        found: NDArray[np.float64] = climbs_m * potential_share(physics) * physics.weight_n
        return weights.energy / JOULE_PER_KWH * found

    def more(self, here: Place, there: Place) -> bool:
        """Add the fastest way and that of least energy where they are not known; whether one was not."""
        (before,) = self.pairs(here, [there], ())
        self.pairs(here, [there], (FASTEST, ECO))
        return not (before.holds(FASTEST) and before.holds(ECO))

    def refined(
        self, here: Place, there: Place, bound: Way, most_s: float, most_j: float, most_stretch_j: float
    ) -> bool:
        """Learn more of ways between two places near a bound; whether there was anything to be learnt.

        By a search between its neighbours, or by comparing all ways that take no more than most_s and most_j, of which
        no stretch takes more than most_stretch_j.
        """
        (pair,) = self.pairs(here, [there], ())
        weights = pair.chord_at(bound)
        if weights is not None:
            path = self._find(here, [there], weights)[0]
            if path is None:
                return False
            ways = undominated([*pair.ways, self._way(path)])
            pair = replace(pair, ways=ways, lines=(*pair.lines, Line.of(weights, path.cost)))
        elif pair.is_whole(most_s, most_j) or pair.given_up or not all_ways_are_comparable(self.space):
            return False
        else:
            self._counts.compared += 1
            self._counts.labels += COMPARISON
            if pair.whole_s > 0.0:
                most_s, most_j = max(most_s, pair.whole_s), max(most_j, pair.whole_j)
            paths = all_ways(self.space, here, there, most_s, most_j, most_stretch_j)
            ways = undominated([*pair.ways, *(self._way(path) for path in paths or ())])
            if paths is None:
                pair = replace(pair, given_up=True)
            else:
                pair = replace(pair, ways=ways, whole_s=most_s, whole_j=most_j)
        self._store.put(self._space_key, {(here, there): pair})
        return True

    def _searched(
        self, here: Place, there: Sequence[Place], weights: Weights, known: Mapping[Place, Pair]
    ) -> dict[Place, Pair]:
        """Pairs with the best ways by one more weighting; known: those that there are."""
        found: dict[Place, Pair] = {place: STAY for place in there if same_place(here, place)}
        driven = [place for place in there if place not in found]
        for place, path in zip(driven, self._find(here, driven, weights), strict=True):
            found[place] = self._joined(known.get(place), weights, path)
        return found

    def _joined(self, before: Pair | None, weights: Weights, path: FoundPath | None) -> Pair:
        """A pair with what a search by one more weighting has found."""
        if path is None:
            return NOWHERE
        ways, lines = (before.ways, before.lines) if before is not None else ((), ())
        new = () if any(np.array_equal(way.links, path.links) for way in ways) else (self._way(path),)
        pair = Pair((), ()) if before is None else before
        return replace(pair, ways=undominated([*ways, *new]), lines=(*lines, Line.of(weights, path.cost)))

    def _find(self, here: Place, there: Sequence[Place], weights: Weights) -> list[FoundPath | None]:
        search = self._store.search
        if not there:
            return []
        if len(there) > FEW_TARGETS:
            self._counts.searches += 1
            found, counts = find_paths(
                self.space, search.pool, weights, Limits(), here, there, label_limit=search.label_limit
            )
            self._counts.crowded |= counts.crowded > 0
            self._counts.labels += counts.labels_settled
            return found
        options = PathOptions(label_limit=search.label_limit)
        paths = []
        for place in there:
            self._counts.searches += 1
            path, counts = find_path(self.space, search.pool, weights, Limits(), here, place, options)
            self._counts.crowded |= counts.crowded > 0
            self._counts.labels += counts.labels_settled
            paths.append(path)
        return paths

    def _way(self, path: FoundPath) -> Way:
        return profile_of(path, *self._drives.uncharged(path))


def _put_latest(kept: dict[Hashable, Answer], question: Hashable, answer: Answer, most: int = WAYS_KEPT) -> None:
    """Keep an answer, and no more than the latest ones."""
    kept[question] = answer
    if len(kept) > most:
        del kept[next(iter(kept))]


def _never(_target: int, _cost: float, _via: float) -> bool:
    return False


def usual_weightings(mixed: Weights, *, bounded: bool) -> tuple[Weights, ...]:
    """Weightings of searches to many places: a mixed one, and those that bound what no way is better than."""
    return (mixed, FASTEST, ECO) if bounded else (mixed,)
