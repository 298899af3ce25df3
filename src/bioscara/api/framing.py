"""Messages as bytes: a length, then msgpack, or JSON where the first message is JSON."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from functools import cached_property
from numbers import Integral, Real
from typing import Any

import msgspec

from bioscara.api.messages import FromClient, FromOwner
from bioscara.errors import BioscaraError, InvalidArgumentError, ProtocolError
from bioscara.printing import encodable

HELLO_MAX = 4 << 10
"""Longest first message of a client [byte]."""
REQUEST_MAX = 256 << 10
"""Longest message of a client [byte]: to read a longer one takes so long that other clients would
wait. Longer trajectories are uploaded in parts."""
ANSWER_MAX = 64 << 20
"""Longest message of an owner [byte]."""
_LENGTH = struct.Struct(">I")


def _plain(value: Any) -> int | float:
    """Return a number of numpy, or of another class than Python's own, as one of those."""
    kind = getattr(getattr(value, "dtype", None), "kind", "")
    if isinstance(value, Integral) or (kind in {"i", "u"} and value.shape == ()):
        return int(value)
    if isinstance(value, Real) or (kind == "f" and value.shape == ()):
        return float(value)
    raise TypeError(f"a {type(value).__name__} cannot be sent")


_SAME: Any = {"builtin_types": (bytes,), "enc_hook": _plain}
_packed = msgspec.msgpack.Encoder(enc_hook=_plain).encode
_json = msgspec.json.Encoder(enc_hook=_plain).encode
from_client: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(FromClient)
from_owner: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(FromOwner)
json_from_client: msgspec.json.Decoder[Any] = msgspec.json.Decoder(FromClient)


def encode_packed(message: object) -> bytes:
    """Return a message as msgpack; names of files that are not UTF-8 are escaped."""
    try:
        return _packed(message)
    except UnicodeEncodeError:
        return _packed(_encodable(msgspec.to_builtins(message, **_SAME)))


def encode_json(message: object) -> bytes:
    """Return a message as JSON; names of files that are not UTF-8 are escaped."""
    try:
        return _json(message)
    except UnicodeEncodeError:
        return _json(_encodable(msgspec.to_builtins(message, **_SAME)))


def _encodable(value: Any) -> Any:
    match value:
        case str():
            return encodable(value)
        case dict():
            return {_encodable(key): _encodable(each) for key, each in value.items()}
        case list() | tuple():
            return [_encodable(each) for each in value]
    return value


def unusable(error: Exception) -> BioscaraError:
    """Return the error for a message that cannot be decoded: of a value, that of a program."""
    if isinstance(error.__cause__, BioscaraError):
        return error.__cause__
    malformed = isinstance(error, msgspec.DecodeError | RecursionError)
    if malformed and not isinstance(error, msgspec.ValidationError):
        return ProtocolError(f"the message cannot be read: {error}")
    return InvalidArgumentError(f"the request cannot be used: {error}")


def framed(payload: bytes) -> bytes:
    """Return a message with its length before it."""
    return _LENGTH.pack(len(payload)) + payload


def packed(message: object) -> bytes:
    """Return a message as msgpack with its length before it."""
    return framed(encode_packed(message))


class Framed:
    """A message as bytes, made once for all clients of a form."""

    def __init__(self, message: object) -> None:
        self._message = message

    @cached_property
    def packed(self) -> bytes:
        """As msgpack, with its length before it."""
        return packed(self._message)

    @cached_property
    def json(self) -> bytes:
        """As JSON, with its length before it."""
        return framed(encode_json(self._message))


class MessageSplitter:
    """Splits a stream of bytes into messages.

    Args:
        longest: Longest message that is accepted [byte].

    Attributes:
        longest: As given; may be changed.
    """

    def __init__(self, longest: int) -> None:
        self.longest = longest
        self._buffer = bytearray()

    def feed(self, data: bytes) -> Iterator[bytes]:
        """Take received bytes; yield the messages that are complete.

        Those that are not taken stay: the next call yields them.

        Raises:
            ProtocolError: A message is announced that is too long.
        """
        buffer = self._buffer
        buffer += data
        while len(buffer) >= _LENGTH.size:
            (length,) = _LENGTH.unpack_from(buffer)
            if length > self.longest:
                raise ProtocolError(
                    f"a message of {length} bytes is announced, and at most {self.longest} are "
                    "accepted"
                )
            end = _LENGTH.size + length
            if len(buffer) < end:
                return
            message = bytes(memoryview(buffer)[_LENGTH.size : end])
            del buffer[:end]
            yield message
