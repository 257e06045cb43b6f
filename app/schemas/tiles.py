"""What the tiles of a graph are, as TileJSON."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from app.schemas.base import Answered

Bounds = tuple[float, float, float, float]


class VectorLayer(Answered):
    """One layer of vector tiles."""

    id: str
    description: str
    minzoom: int
    maxzoom: int
    fields: dict[str, str] = Field(description="attributes of the layer's lines, and what they mean")


class HeightTilesNote(Answered):
    """Heights as a raster-dem source of a map."""

    tiles: list[str] = Field(
        description="address of a tile with {z}, {x} and {y}, whole, so that a page of any origin can use it"
    )
    encoding: Literal["terrarium"] = Field(description="height [m] = 256 R + G + B / 256 − 32768")
    tileSize: int = Field(description="pixels along a side")  # noqa: N815 (the name that maps read)
    minzoom: int
    maxzoom: int = Field(description="the finest level that the heights are good for; closer views enlarge it")
    bounds: Bounds = Field(description="west, south, east, north [deg]")


class GraphTileJSON(Answered):
    """TileJSON 3.0 of a graph's roads, with its heights beside them."""

    tilejson: Literal["3.0.0"]
    name: str
    attribution: str
    scheme: Literal["xyz"]
    tiles: list[str] = Field(
        description="address of a tile with {z}, {x} and {y}, whole, so that a page of any origin can use it"
    )
    minzoom: int
    maxzoom: int
    bounds: Bounds = Field(description="west, south, east, north [deg]")
    vector_layers: list[VectorLayer]
    heights: HeightTilesNote | None = Field(description="null where the graph has no heights")
