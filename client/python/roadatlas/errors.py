"""What can go wrong between a client and the daemon, as types."""

import enum


class Code(enum.IntEnum):
    """Codes of an `Error` (docs/protocol.md, Errors). Frozen."""

    INVALID_ARGUMENT = 1
    INVALID_DATA = 2
    NOT_FOUND = 3
    CONFLICT = 4
    UNAVAILABLE = 5
    TIMEOUT = 6
    RESOURCE_EXHAUSTED = 7
    UNSUPPORTED = 8
    PERMISSION_DENIED = 9
    INTERNAL = 10

    @classmethod
    def _missing_(cls, value: object) -> "Code":
        return cls.INTERNAL


class RoadAtlasError(Exception):
    """Every failure that this package reports."""


class RequestRefused(RoadAtlasError):
    """The daemon answered with an `Error`. `request_id` 0: it closes the connection. `reason`: "quota" and the like,
    where the code does not tell it all; else empty."""

    def __init__(self, request_id: int, code: int, message: str, retry: bool, retry_after_ms: int,
                 reason: str = "") -> None:
        super().__init__(f"{Code(code).name.lower()}: {message}")
        self.request_id = request_id
        self.code = Code(code)
        self.message = message
        self.retry = retry
        self.retry_after_ms = retry_after_ms
        self.reason = reason


class ConnectionLost(RoadAtlasError):
    """The daemon is not there, closed the connection, or the network broke."""


class OtherAtlas(RoadAtlasError):
    """Another atlas answers than before: nothing that was said of the first one counts there."""


class BadCredentials(RoadAtlasError):
    """A certificate, key or token file that is of no use, or half of what it takes: a setting of ours."""


class PlaintextRefused(RoadAtlasError):
    """The host is another machine, and nothing is sent there in the clear unless that is allowed: a setting of ours."""


class TlsFailed(RoadAtlasError):
    """TLS could not begin, or was ended by the daemon: it fails again until a setting changes, here or there."""


class UntrustedDaemon(TlsFailed):
    """Its certificate has expired, or is from nobody that we trust, or names another daemon."""


class CertificateRefused(TlsFailed):
    """The daemon does not take the certificate that we showed."""


class DeadlinePassed(RoadAtlasError):
    """The daemon did not answer in the time that this client allows."""


class DaemonTooOld(RoadAtlasError):
    """The daemon speaks an earlier version of the protocol, and would pass over what is asked of it."""


class BrokenReply(RoadAtlasError):
    """What the daemon sent is not what the protocol says."""


class FrameError(BrokenReply):
    """A broken frame; the connection is of no use any more."""


class BadMagic(FrameError):
    """The bytes are no frame."""


class FrameTooLong(FrameError):
    """A payload above the limit."""


class BadChecksum(FrameError):
    """A payload that is not what was sent."""


class FrameCut(FrameError):
    """The connection ended within a frame."""


class BadTileBlob(BrokenReply):
    """A tile blob that breaks docs/formats/tile.md."""


class UselessDelta(BadTileBlob):
    """A delta that does not give the content that it should: damaged, or its base is not what is held."""
