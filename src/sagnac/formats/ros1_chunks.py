"""Messages of a ROS 1 bag by whole chunks.

The library reads one message after another, which takes most of the time for a bag of millions.
It has read the index, though, which says where in which chunk each message lies. So each chunk is
unpacked once, and all messages of a connection are taken out of it together.

A record is a header and data, each after its length. The header of a message has three fields of
one length, so that all headers are alike except for the time. Before the first message of a
connection its definition may stand (bag format 2.0).
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sagnac.arrays import IntegerArray

_CONNECTION: Final = b"op=\x07"
_MESSAGE: Final = b"op=\x02"
_TIME: Final = b"time="
_TIME_BYTES: Final = 8
_LENGTH: Final = 4

Bytes = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, kw_only=True)
class Messages:
    """Messages of one connection that lie in one chunk.

    Attributes
    ----------
    chunk
        (bytes,) of the chunk, unpacked.
    begin, end
        (messages,) where each lies in it.
    received
        (messages,) ns.
    """

    chunk: Bytes
    begin: IntegerArray
    end: IntegerArray
    received: IntegerArray

    def first(self, offset: int, count: int) -> Bytes:
        """(messages, count) bytes from `offset` after the beginning of each."""
        return self._from(self.begin + offset, count)

    def last(self, count: int) -> Bytes:
        """(messages, count) bytes at the end of each."""
        return self._from(self.end - count, count)

    def _from(self, start: IntegerArray, count: int) -> Bytes:
        taken: Bytes = self.chunk[start[:, np.newaxis] + np.arange(count)]
        return taken


def messages_of(reader: Any, connection: int) -> Iterator[Messages]:
    """Messages of a connection, chunk by chunk, in the order in which they were received.

    Parameters
    ----------
    reader
        An open `rosbags.rosbag1.Reader`.
    connection
        Its number.

    Raises
    ------
    ValueError
        If a chunk is cut off, or does not hold messages where the index says so.
    """
    index = reader.indexes[connection]
    size = len(index)
    received = np.fromiter((entry.time for entry in index), np.int64, size)
    place = np.fromiter((entry.chunk_pos for entry in index), np.int64, size)
    offset = np.fromiter((entry.offset for entry in index), np.int64, size)
    ends = [*(np.flatnonzero(np.diff(place)) + 1).tolist(), size] if size else []
    begin = 0
    for end in ends:
        own = slice(begin, end)
        chunk = _unpacked(reader, int(place[begin]))
        first, last = _places(chunk, offset[own], connection)
        yield Messages(
            chunk=np.frombuffer(chunk, np.uint8), begin=first, end=last, received=received[own]
        )
        begin = end


def _unpacked(reader: Any, place: int) -> bytes:
    """The bytes of a chunk."""
    held = reader.chunks[place]
    reader.bio.seek(held.datapos)
    packed = reader.bio.read(held.datasize)
    if len(packed) != held.datasize:
        raise ValueError("a chunk is cut off")
    unpacked: bytes = held.decompressor(packed)
    return unpacked


def _places(
    chunk: bytes, offset: IntegerArray, connection: int
) -> tuple[IntegerArray, IntegerArray]:
    """Where the data of messages begin and end whose records lie at `offset`."""
    offset = offset.copy()
    # Only the first of a chunk has definitions before it.
    lowest = int(np.argmin(offset))
    offset[lowest] = _past_definitions(chunk, int(offset[lowest]))
    length = _number(chunk, int(offset[lowest]))
    header = chunk[int(offset[lowest]) + _LENGTH :][:length]
    if _MESSAGE not in header or b"conn=" + connection.to_bytes(_LENGTH, "little") not in header:
        raise ValueError("there is no message where the index says so")
    values = np.frombuffer(chunk, np.uint8)
    whole = 2 * _LENGTH + length
    if int(offset.max()) + whole > values.size:
        raise ValueError("the index points beyond its chunk")
    records = values[offset[:, np.newaxis] + np.arange(whole)]
    same = np.ones(_LENGTH + length, dtype=np.bool_)
    time = _LENGTH + header.index(_TIME) + len(_TIME)
    same[time : time + _TIME_BYTES] = False
    if np.any(records[:, : same.size][:, same] != records[lowest, : same.size][same]):
        raise ValueError("there is no message where the index says so")
    sizes = np.ascontiguousarray(records[:, same.size :]).view("<u4")[:, 0].astype(np.int64)
    begin = offset + whole
    end = begin + sizes
    if int(end.max()) > values.size:
        raise ValueError("a message is cut off")
    return begin, end


def _past_definitions(chunk: bytes, offset: int) -> int:
    """Where the first record from `offset` on lies that defines no connection."""
    while True:
        length = _number(chunk, offset)
        after = offset + _LENGTH + length
        if _CONNECTION not in chunk[offset + _LENGTH : after]:
            return offset
        offset = after + _LENGTH + _number(chunk, after)


def _number(chunk: bytes, offset: int) -> int:
    try:
        return int(struct.unpack_from("<I", chunk, offset)[0])
    except struct.error:
        raise ValueError("a record is cut off") from None
