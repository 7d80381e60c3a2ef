"""Client of a Road Atlas daemon, written from docs/protocol.md and docs/formats alone (docs/python.md)."""

from roadatlas import geometry
from roadatlas.changes import Changes
from roadatlas.client import AtlasClient, QueryReply
from roadatlas.credentials import read_token
from roadatlas.errors import Code, DaemonTooOld, OtherAtlas, RequestRefused, RoadAtlasError
from roadatlas.session_uploader import SessionUploader
from roadatlas.sync_reply import SyncReply
from roadatlas.tile_store import TileStore
from roadatlas.tls import Tls
from roadatlas.watch import Watch

__all__ = ["AtlasClient", "Changes", "Code", "DaemonTooOld", "OtherAtlas", "QueryReply", "RequestRefused",
           "RoadAtlasError", "SessionUploader", "SyncReply", "TileStore", "Tls", "Watch", "geometry", "read_token"]
