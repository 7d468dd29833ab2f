#!/usr/bin/python3
"""Prints the messages of an MCAP file, a line of JSON each, decoded by the schemas in the file itself.

usage: mcap_messages.py FILE

Written from the specification (https://mcap.dev/spec) alone. Exit code 1, with the violation, if checksums, indexes,
counts or offsets of the file do not agree with its content. Needs python3-protobuf."""
import json
import struct
import sys
import zlib
from collections import Counter

from google.protobuf import descriptor_pb2, descriptor_pool, json_format, message_factory

MAGIC = b"\x89MCAP0\r\n"
FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX, STATISTICS, DATA_END = 2, 3, 4, 5, 6, 7, 8, 11, 15


class Fields:
    def __init__(self, data):
        self.data, self.at = data, 0

    def numbers(self, layout):
        values = struct.unpack_from("<" + layout, self.data, self.at)
        self.at += struct.calcsize("<" + layout)
        return values if len(values) > 1 else values[0]

    def block(self):
        size = self.numbers("I")
        self.at += size
        assert self.at <= len(self.data), "a field exceeds its record"
        return self.data[self.at - size:self.at]

    def text(self):
        return self.block().decode()

    def pairs(self, layout):
        inner, out = Fields(self.block()), []
        while inner.at < len(inner.data):
            out.append(inner.numbers(layout))
        return out

    def rest(self):
        return self.data[self.at:]


def records(data, start=0):
    """Opcode, offset of the record, content."""
    at = start
    while at < len(data):
        opcode, size = struct.unpack_from("<BQ", data, at)
        assert at + 9 + size <= len(data), "a record exceeds its container"
        yield opcode, at, data[at + 9:at + 9 + size]
        at += 9 + size


def message_type(schema):
    number, name, encoding, files = schema
    assert encoding == "protobuf"
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(files).file:
        pool.Add(file)  # Fails if an import is missing before it.
    return message_factory.MessageFactory(pool).GetPrototype(pool.FindMessageTypeByName(name))


def chunk_messages(offset, content, data):
    """Channels' and schemas' records, and the messages, of a chunk; the indexes after it are checked."""
    f = Fields(content)
    first, last, size, crc = f.numbers("QQQI")
    assert f.text() == "" and f.numbers("Q") == size
    inner = f.rest()
    assert len(inner) == size and zlib.crc32(inner) == crc, "a chunk's checksum"
    found, times = {}, []
    for opcode, at, record in records(inner):
        yield opcode, record
        if opcode == MESSAGE:
            channel, _, logged = Fields(record).numbers("HIQ")
            found.setdefault(channel, []).append((logged, at))
            times.append(logged)
    assert (min(times), max(times)) == (first, last), "the times of a chunk"
    for opcode, _, record in records(data, offset + 9 + len(content)):
        if opcode != MESSAGE_INDEX:
            break
        f = Fields(record)
        channel = f.numbers("H")
        assert found.pop(channel) == f.pairs("QQ"), "an index of messages"
    assert not found, "messages without an index"


def main(path):
    data = open(path, "rb").read()
    assert data[:8] == MAGIC and data[-8:] == MAGIC, "the magic"
    schemas, channels, counts, chunks, indexed, statistics = {}, {}, Counter(), {}, {}, None
    summary_start, _, summary_crc = struct.unpack_from("<QQI", data, len(data) - 28)
    assert zlib.crc32(data[summary_start:-12]) == summary_crc, "the checksum of the summary"
    for opcode, at, content in records(data[:-8], 8):
        inner = [(opcode, content)]
        if opcode == CHUNK:
            chunks[at] = 9 + len(content)
            inner = chunk_messages(at, content, data)
        for code, record in inner:
            f = Fields(record)
            if code == SCHEMA:
                schema = (f.numbers("H"), f.text(), f.text(), f.block())
                assert schemas.setdefault(schema[0], schema) == schema, "a schema changes"
            elif code == CHANNEL:
                channel = (*f.numbers("HH"), f.text(), f.text(), f.block())
                assert channel[1] in schemas and channels.setdefault(channel[0], channel) == channel
            elif code == MESSAGE:
                number, sequence, logged, published = f.numbers("HIQQ")
                assert sequence == counts[number], "the sequence of a channel"
                counts[number] += 1
                message = message_type(schemas[channels[number][1]]).FromString(f.rest())
                print(json.dumps({"topic": channels[number][2], "schema": schemas[channels[number][1]][1],
                                  "logged_ns": logged, "published_ns": published, "bytes": f.rest().hex(),
                                  "message": json_format.MessageToDict(message)}))
            elif code == CHUNK_INDEX:
                _, _, start, size = f.numbers("QQQQ")
                indexed[start] = size
            elif code == STATISTICS:
                statistics = (f.numbers("QHIIII"), f.numbers("QQ"), dict(f.pairs("HQ")))
            elif code == DATA_END:
                assert at + 13 == summary_start, "the place of the summary"
    assert indexed == chunks, "the index of the chunks"
    assert statistics[0] == (sum(counts.values()), len(schemas), len(channels), 0, 0, len(chunks)), "the statistics"
    assert statistics[2] == counts, "the counts of the channels"


if __name__ == "__main__":
    main(sys.argv[1])
