"""MCAP files and ROS bags. Their readers are optional packages; an error names a missing one."""

import bz2
import io
import json
import os
import sqlite3
import struct
from collections.abc import Callable, Collection, Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, cast
from urllib.parse import quote

from airground_drake.base import files
from airground_drake.base.errors import LogError, described
from airground_drake.study.logs.messages import Gathered
from airground_drake.study.logs.stream import Log

HINT = "pip install 'airground_drake[logs]'"
MCAP = b"\x89MCAP0\r\n"  # how an MCAP file begins and ends
# How a ROS 1 bag, the file of a ROS 2 bag, and what zstd has packed begin.
ROS1, SQLITE, ZSTD = b"#ROSBAG V2.0", b"SQLite format 3\0", b"\x28\xb5\x2f\xfd"
LONGEST_MESSAGE = 50_000_000  # bytes of a message that is decoded
DENSEST = 20  # all parts of a file may unpack to this multiple of its size, if that is more than `files.MOST_UNPACKED`
BLOCK = 1_000_000  # bytes that are unpacked at once
Decode = Callable[[bytes], Any]


class Channel(NamedTuple):
    """A group of messages: topic, type name, encoding, and type definition."""

    topic: str
    kind: str
    encoding: str
    schema_encoding: str
    definition: bytes


Message = tuple[Channel, int, bytes]  # its channel, when it was received, ns, and its content


class Unpacker:
    """Unpacks parts of an untrusted file, up to a limit for each part and for all of them."""

    def __init__(self, size: int) -> None:
        self.left = max(files.MOST_UNPACKED, DENSEST * size)

    def unpacked(self, data: bytes, how: str) -> bytes:
        """The content of a part compressed by zstd, lz4 or bz2; LogError if it is too large or damaged."""
        out = io.BytesIO()
        self.copy(io.BytesIO(data), how, out, files.LARGEST_FILE)
        return out.getvalue()

    def copy(self, packed: BinaryIO, how: str, out: BinaryIO, most: int) -> None:
        """Unpack from one file to another, up to a limit; LogError as in `unpacked`."""
        most, count = min(most, self.left), 0
        source = _unpacking(packed, how)
        while block := source.read(BLOCK):
            count += len(block)
            if count > most:
                raise LogError(f"it unpacks to more than {most} bytes, the most allowed; wanted: fewer topics in it")
            out.write(block)
        self.left -= count


def _unpacking(packed: BinaryIO, how: str) -> BinaryIO:
    """A file that unpacks another one as it is read."""
    if how == "bz2":
        return cast("BinaryIO", bz2.BZ2File(packed))
    try:
        if how == "zstd":
            import zstandard

            return cast("BinaryIO", zstandard.ZstdDecompressor().stream_reader(packed, read_across_frames=True))
        if how == "lz4":
            import lz4.frame

            return cast("BinaryIO", lz4.frame.LZ4FrameFile(packed))
    except ImportError:
        raise LogError(f"what is compressed by {how} needs the packages of the extra: {HINT}") from None
    raise LogError(f"it is compressed by {how!r:.40}; allowed: zstd, lz4, bz2")


def read_mcap(path: Path, bodies: Collection[str]) -> Log:
    """The streams of an MCAP file: messages in JSON, protobuf, or the encodings of ROS 1 and ROS 2."""
    try:
        from mcap.exceptions import EndOfFile
    except ImportError:
        raise LogError(f"an MCAP file needs the package mcap: {HINT}") from None
    gathered = Gathered(str(path), tuple(bodies))
    with _opened(path) as file:
        file.seek(-len(MCAP), os.SEEK_END)
        is_cut = file.read() != MCAP  # as after a crash of the recorder
        file.seek(0)
        try:
            _gather(_of_mcap(file), gathered, os.fstat(file.fileno()).st_size)
        except LogError:
            raise
        except Exception as error:  # the package raises many kinds
            if not (is_cut and isinstance(error, (EndOfFile, struct.error)) and gathered.used):
                raise LogError(f"it cannot be read as MCAP to its end: {described(error)}") from None
    cut = ["cut off, and read up to there"] if is_cut else []
    return Log(list(gathered.streams()), [f"{path.name}: {remark}" for remark in (*cut, *gathered.ignored())])


def _opened(path: Path) -> BinaryIO:
    """A regular file, open for reading; OSError for anything else."""
    return open(files.open_regular(path, links=True), "rb")


def _of_mcap(file: BinaryIO) -> Iterator[Message]:
    # The readers of the package `mcap` unpack chunks without a limit; so chunks are unpacked here.
    from mcap.records import Channel as McapChannel
    from mcap.records import Chunk, Schema
    from mcap.records import Message as McapMessage
    from mcap.stream_reader import StreamReader, breakup_chunk

    size = os.fstat(file.fileno()).st_size
    unpacker, schemas, channels = Unpacker(size), dict[int, Schema](), dict[int, Channel]()
    for record in StreamReader(file, emit_chunks=True, validate_crcs=True, record_size_limit=size).records:
        inner = [record]
        if isinstance(record, Chunk):
            data = unpacker.unpacked(record.data, record.compression) if record.compression else record.data
            inner = breakup_chunk(replace(record, compression="", data=data), validate_crc=True)
        for part in inner:
            if isinstance(part, Schema):
                schemas[part.id] = part
            elif isinstance(part, McapChannel):
                schema = schemas[part.schema_id] if part.schema_id else Schema(0, b"", "", "")
                channels[part.id] = Channel(
                    part.topic, schema.name, part.message_encoding, schema.encoding, schema.data
                )
            elif isinstance(part, McapMessage):
                yield channels[part.channel_id], part.log_time, part.data


def _gather(messages: Iterator[Message], gathered: Gathered, size: int) -> None:
    """Collect the positions in messages. Channels that cannot be decoded are named and skipped."""
    # size: bytes
    decoders, unpacker = dict[Channel, Decode | None](), Unpacker(size)
    for channel, received_ns, data in messages:
        topic, kind = channel.topic, channel.kind
        if not gathered.may_have(topic, kind) or len(data) > LONGEST_MESSAGE:
            continue
        if channel.encoding == "cdr" and data.startswith(ZSTD):  # no message in CDR begins so
            data = unpacker.unpacked(data, "zstd")
        try:
            if channel not in decoders:
                decoders[channel] = _decoder(channel)
            if (decode := decoders[channel]) is None:
                gathered.unused[topic] = f"{kind}, encoded as {channel.encoding!r:.40}"
                continue
            decoded = decode(data)
        except LogError:
            raise
        except Exception as error:  # of hostile or unknown definitions
            gathered.unused[topic] = f"{kind}: {described(error)}"
            continue
        gathered.add(topic, kind, received_ns, decoded)


def _decoder(channel: Channel) -> Decode | None:
    if channel.encoding == "json":
        return json.loads
    if channel.encoding == "protobuf":
        try:
            from mcap.records import Schema
            from mcap_protobuf.decoder import DecoderFactory
        except ImportError:
            raise LogError(f"messages in protobuf need the package mcap-protobuf-support: {HINT}") from None
        schema = Schema(1, channel.definition, channel.schema_encoding, channel.kind)
        return DecoderFactory().decoder_for(channel.encoding, schema)
    if channel.encoding in ("cdr", "ros1") and channel.kind:
        return _of_ros(channel)
    return None


def _of_ros(channel: Channel) -> Decode:
    """Decode a ROS message by the definition in the file, completed by the distribution's types."""
    typesys = _typesys()
    kind, is_ros1 = channel.kind, channel.encoding == "ros1"
    name, known = kind if "/msg/" in kind else kind.replace("/", "/msg/", 1), {}
    if channel.schema_encoding in ("ros2msg", "ros1msg") and channel.definition.strip():
        known = typesys.get_types_from_msg(channel.definition.decode(), name)
    store = typesys.get_typestore(typesys.Stores.EMPTY)
    try:
        store.register(known)
        is_complete = name in store.fielddefs
    except typesys.TypesysError:
        is_complete = False
    if not is_complete:
        store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC if is_ros1 else typesys.Stores.ROS2_HUMBLE)
        store.register({kind: given for kind, given in known.items() if kind not in store.fielddefs})
    decode = store.deserialize_ros1 if is_ros1 else store.deserialize_cdr
    return lambda data: decode(data, name)


def _typesys() -> Any:
    try:
        from rosbags import typesys
    except ImportError:
        raise LogError(f"messages of ROS need the package rosbags: {HINT}") from None
    return typesys


def read_ros(path: Path, bodies: Collection[str], *, is_ros1: bool) -> Log:
    """The streams of a ROS 1 bag, or of a .db3 file of a ROS 2 bag."""
    _typesys()
    gathered = Gathered(str(path), tuple(bodies))
    with _opened(path) as file:
        size = os.fstat(file.fileno()).st_size
    try:
        _gather(_of_ros1(path, size) if is_ros1 else _of_db3(path), gathered, size)
    except LogError:
        raise
    except Exception as error:  # the packages raise many kinds
        raise LogError(f"it cannot be read as a ROS bag: {described(error)}") from None
    return Log(list(gathered.streams()), [f"{path.name}: {remark}" for remark in gathered.ignored()])


def _of_ros1(path: Path, size: int) -> Iterator[Message]:
    """The messages of a ROS 1 bag, in the order of their receipt."""
    from rosbags.rosbag1 import Reader, reader

    unpacker = Unpacker(size)

    class Bounded(Reader):  # type: ignore[misc, unused-ignore]  # of an extra, which may be missing
        """Unpacks chunks up to a limit."""

        def read_chunk(self) -> Any:
            chunk = super().read_chunk()
            how = next(name for name, decompress in reader.decompressors.items() if decompress is chunk.decompressor)
            return chunk if how == "none" else chunk._replace(decompressor=lambda data: unpacker.unpacked(data, how))

    with Bounded(path) as bag:
        channels = {
            connection.id: Channel(
                connection.topic, connection.msgtype, "ros1", "ros1msg", connection.msgdef.data.encode()
            )
            for connection in bag.connections
        }
        for connection, received_ns, raw in bag.messages():
            yield channels[connection.id], received_ns, raw


def _of_db3(path: Path) -> Iterator[Message]:
    """The messages of a .db3 file, in the order of their receipt; files beside it are not opened."""
    for beside in (Path(f"{path}-wal"), Path(f"{path}-journal")):  # of a recorder that was killed
        if beside.exists() and beside.stat().st_size:
            raise LogError(f"{beside.name} beside it has messages that it lacks; wanted: sqlite3 {path.name} VACUUM")
    base = sqlite3.connect(f"file:{quote(str(path))}?mode=ro&immutable=1", uri=True)
    with closing(base):
        base.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, files.LARGEST_FILE)  # a column may be made up by a formula
        tables = {name for (name,) in base.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        if not {"topics", "messages"} <= tables:
            raise LogError("it is no ROS bag: it lacks the tables topics and messages")
        definitions: dict[str, tuple[str, bytes]] = {}
        if "message_definitions" in tables:
            sql = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
            definitions = {kind: (encoding, text.encode()) for kind, encoding, text in base.execute(sql)}
        channels = {
            number: Channel(topic, kind, encoding, *definitions.get(kind, ("", b"")))
            for number, topic, kind, encoding in base.execute("SELECT id, name, type, serialization_format FROM topics")
        }
        sql = "SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp"
        for number, received_ns, raw in base.execute(sql):
            if number not in channels:
                raise LogError("it is damaged: a message has no topic")
            yield channels[number], received_ns, raw


def unpack(path: Path, out: BinaryIO) -> None:
    """Unpack a file that zstd has packed; LogError if it is broken or too large."""
    with _opened(path) as file:
        try:
            Unpacker(0).copy(file, "zstd", out, files.MOST_UNPACKED)
        except LogError:
            raise
        except Exception as error:  # the package raises its own
            raise LogError(f"it cannot be unpacked: {described(error)}") from None
