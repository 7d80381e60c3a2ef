"""Client of a Road Atlas daemon, written from docs/protocol.md and docs/formats alone (docs/python.md)."""

from roadatlas import geometry
from roadatlas.client import AtlasClient, QueryReply, SyncReply
from roadatlas.errors import Code, RequestRefused, RoadAtlasError
from roadatlas.tile_store import TileStore

__all__ = ["AtlasClient", "Code", "QueryReply", "RequestRefused", "RoadAtlasError", "SyncReply", "TileStore",
           "geometry"]
