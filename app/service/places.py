"""The use cases of places: searched by name, found by coordinates, named in requests."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.places.finding import reverse_places, search_places
from app.places.nominatim import UNKNOWN, nominatim_collection, nominatim_list, nominatim_place
from app.places.photon import photon_collection
from app.places.shelf import PlacesShelf
from app.places.texts import with_places
from app.schemas.as_json import as_json

if TYPE_CHECKING:
    from typing import TypeVar

    from app.atlas import Atlas
    from app.places.finding import PlaceOnGraph
    from app.places.parameters import ReverseParameters, SearchParameters
    from app.schemas.drive import DriveRequest
    from app.settings import Settings

    Asked = TypeVar("Asked", bound=DriveRequest)


class Places:
    """Places of the graphs of an atlas; answers from any thread."""

    def __init__(self, atlas: Atlas, settings: Settings) -> None:
        self.shelf = PlacesShelf(atlas)
        self._atlas = atlas
        self._settings = settings

    def search(self, sent: SearchParameters, accept_language: str = "") -> list[PlaceOnGraph]:
        """What a text may mean, the likeliest first; raises as PlacesShelf.chosen does."""
        return search_places(self.shelf, self._settings.default_graph, sent, sent.languages(accept_language))

    def search_json(self, sent: SearchParameters, accept_language: str = "") -> bytes:
        """The same in the form that is asked for."""
        found = self.search(sent, accept_language)
        if sent.format == "photon":
            return as_json(photon_collection(found))
        if sent.format == "geojson":
            return as_json(nominatim_collection(found, with_address=sent.addressdetails == "1"))
        listed = nominatim_list(found, sent.format, with_address=sent.addressdetails == "1")
        return b"[" + b",".join(map(as_json, listed)) + b"]"

    def reverse_json(self, sent: ReverseParameters, accept_language: str = "") -> bytes:
        """What is at a place, in the form that is asked for; raises as PlacesShelf.chosen does."""
        languages = sent.languages(accept_language)
        found = reverse_places(self.shelf, self._atlas, self._settings.default_graph, sent, languages)
        if sent.format == "photon":
            return as_json(photon_collection(found))
        with_address = sent.addressdetails != "0"
        if sent.format == "geojson":
            return as_json(nominatim_collection(found[:1], with_address=with_address))
        return as_json(nominatim_place(found[0], sent.format, with_address=with_address) if found else UNKNOWN)

    def in_place_of_texts(self, sent: Asked) -> Asked:
        """A request with coordinates in place of texts; raises as with_places does."""
        settings = self._settings
        return with_places(sent, self.shelf, self._atlas, settings.default_graph, settings.snap_limit_m)
