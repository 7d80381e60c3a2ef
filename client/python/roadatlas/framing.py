"""Frames: "RAF1", payload length, low 32 bits of the payload's XXH64, payload (docs/protocol.md, Frames)."""

import struct
from collections.abc import Iterator

import xxhash

from roadatlas.errors import BadChecksum, BadMagic, FrameCut, FrameTooLong

MAGIC = b"RAF1"
HEADER = struct.Struct("<4sII")
MAX_PAYLOAD_BYTES = 48 << 20
MAX_HELLO_BYTES = 16 << 10


def checksum_of(payload: bytes) -> int:
    return xxhash.xxh64_intdigest(payload) & 0xFFFFFFFF


def encode_frame(payload: bytes, limit_bytes: int = MAX_PAYLOAD_BYTES) -> bytes:
    """The frame around one serialized Envelope. FrameTooLong above the limit."""
    if len(payload) > limit_bytes:
        raise FrameTooLong(f"a payload of {len(payload)} bytes, at most {limit_bytes} are allowed")
    return HEADER.pack(MAGIC, len(payload), checksum_of(payload)) + payload


class FrameReader:
    """Turns bytes, cut anywhere, into payloads. After an error it is of no more use."""

    def __init__(self, limit_bytes: int = MAX_PAYLOAD_BYTES) -> None:
        self._limit_bytes = limit_bytes
        self._buffer = bytearray()
        self._header: tuple[int, int] | None = None  # length and checksum, once they are known

    def feed(self, data: bytes) -> Iterator[bytes]:
        """The payloads that `data` completes. BadMagic, FrameTooLong, BadChecksum as early as they show."""
        self._buffer += data
        while (payload := self._next()) is not None:
            yield payload

    def finish(self) -> None:
        """The peer sends no more: FrameCut unless all frames were whole."""
        if self._buffer or self._header:
            raise FrameCut("the connection ended within a frame")

    def _next(self) -> bytes | None:
        if self._header is None:
            self._header = self._take_header()
        if self._header is None or len(self._buffer) < self._header[0]:
            return None
        length, checksum = self._header
        payload = bytes(self._buffer[:length])
        del self._buffer[:length]
        self._header = None
        if checksum_of(payload) != checksum:
            raise BadChecksum(f"a payload of {length} bytes with another checksum")
        return payload

    def _take_header(self) -> tuple[int, int] | None:
        start = bytes(self._buffer[:len(MAGIC)])
        if not MAGIC.startswith(start):
            raise BadMagic(f"a frame begins with {start.hex(' ')}")
        if len(self._buffer) < HEADER.size:
            return None
        _, length, checksum = HEADER.unpack_from(self._buffer)
        if length > self._limit_bytes:
            raise FrameTooLong(f"a payload of {length} bytes, at most {self._limit_bytes} are allowed")
        del self._buffer[:HEADER.size]
        return length, checksum
