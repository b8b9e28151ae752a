"""MCAP files and ROS bags. The packages that read them are extras: where one is missing, one line names it."""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

from airground_drake.base.errors import LogError, described
from airground_drake.logs.messages import Gathered
from airground_drake.logs.stream import Log

HINT = "pip install 'airground_drake[logs]'"
MCAP = b"\x89MCAP0\r\n"
"""How an MCAP file begins and ends."""
LONGEST_MESSAGE = 50_000_000
"""Bytes of a message that is decoded."""
Decode = Callable[[bytes], Any]


def read_mcap(path: Path, bodies: Collection[str]) -> Log:
    """The streams of an MCAP file: messages in JSON, protobuf, or the encodings of ROS 1 and ROS 2.

    Raises:
        LogError: if it cannot be read, or a package is missing.
    """
    try:
        from mcap.exceptions import EndOfFile
        from mcap.reader import NonSeekingReader, make_reader
    except ImportError:
        raise LogError(f"an MCAP file needs the package mcap: {HINT}") from None
    gathered, decoders = Gathered(str(path), tuple(bodies)), dict[int, Decode | None]()
    with path.open("rb") as file:
        file.seek(-len(MCAP), os.SEEK_END)
        is_cut = file.read() != MCAP  # as after a crash of the recorder
        file.seek(0)
        try:
            reader = NonSeekingReader(file) if is_cut else make_reader(file)
            for schema, channel, message in reader.iter_messages(log_time_order=not is_cut):
                kind = schema.name if schema else ""
                if not gathered.may_have(channel.topic, kind) or len(message.data) > LONGEST_MESSAGE:
                    continue
                if channel.id not in decoders:
                    decoders[channel.id] = _decoder(channel.message_encoding, schema)
                if (decode := decoders[channel.id]) is None:
                    gathered.unused[channel.topic] = f"{kind}, encoded as {channel.message_encoding!r:.40}"
                    continue
                try:
                    decoded = decode(message.data)
                except Exception as error:  # of hostile or unknown definitions
                    gathered.unused[channel.topic] = f"{kind}: {described(error)}"
                    continue
                gathered.add(channel.topic, kind, message.log_time, decoded)
        except LogError:
            raise
        except Exception as error:  # the package raises many kinds
            if not (is_cut and isinstance(error, (EndOfFile, struct.error)) and gathered.used):
                raise LogError(f"it cannot be read as MCAP to its end: {described(error)}") from None
    cut = ["cut off, and read up to there"] * is_cut
    return Log(list(gathered.streams()), [f"{path.name}: {each}" for each in (*cut, *gathered.ignored())])


def _decoder(encoding: str, schema: Any) -> Decode | None:
    """What decodes the messages of a channel; None if nothing does."""
    if encoding == "json":
        return json.loads
    if encoding == "protobuf":
        try:
            from mcap_protobuf.decoder import DecoderFactory
        except ImportError:
            raise LogError(f"messages in protobuf need the package mcap-protobuf-support: {HINT}") from None
        return DecoderFactory().decoder_for(encoding, schema)
    if encoding in ("cdr", "ros1") and schema is not None:
        return _of_ros(encoding, schema)
    return None


def _of_ros(encoding: str, schema: Any) -> Decode:
    """Decode a message of ROS by the definition in the file, else by that of the distribution."""
    stores, types = _rosbags()
    name = schema.name if "/msg/" in schema.name else schema.name.replace("/", "/msg/", 1)
    store = stores.get_typestore(stores.Stores.ROS1_NOETIC if encoding == "ros1" else stores.Stores.ROS2_HUMBLE)
    if schema.encoding in ("ros2msg", "ros1msg") and schema.data.strip():
        known = types(schema.data.decode(), name)
        store.register({kind: given for kind, given in known.items() if kind not in store.fielddefs})
    decode = store.deserialize_ros1 if encoding == "ros1" else store.deserialize_cdr
    return lambda data: decode(data, name)


def _rosbags() -> tuple[Any, Any]:
    try:
        from rosbags import typesys
    except ImportError:
        raise LogError(f"messages of ROS need the package rosbags: {HINT}") from None
    return typesys, typesys.get_types_from_msg


def read_ros(path: Path, bodies: Collection[str]) -> Log:
    """The streams of a ROS bag: a ROS 1 bag, a folder of a ROS 2 bag, or its .db3 file.

    Raises:
        LogError: if it cannot be read, or the package is missing.
    """
    typesys, _ = _rosbags()
    from rosbags.highlevel import AnyReader

    gathered = Gathered(str(path), tuple(bodies))
    try:
        store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
        with AnyReader([path], default_typestore=store) as bag:
            wanted = [each for each in bag.connections if gathered.may_have(each.topic, each.msgtype)]
            for connection, received_ns, raw in bag.messages(connections=wanted) if wanted else ():
                topic, kind = connection.topic, connection.msgtype
                if topic in gathered.unused or len(raw) > LONGEST_MESSAGE:
                    continue
                try:
                    message = bag.deserialize(raw, kind)
                except Exception as error:  # of hostile or unknown definitions
                    gathered.unused[topic] = f"{kind}: {described(error)}"
                    continue
                gathered.add(topic, kind, received_ns, message)
    except Exception as error:  # the package raises many kinds
        raise LogError(f"it cannot be read as a ROS bag: {described(error)}") from None
    return Log(list(gathered.streams()), [f"{path.name}: {each}" for each in gathered.ignored()])
