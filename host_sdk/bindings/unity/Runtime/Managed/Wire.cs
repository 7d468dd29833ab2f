// Reader of protobuf's binary form, as strict as protobuf's own parser: unknown fields are ignored, and invalid
// messages throw. And a writer for requests.
using System;
using System.Collections.Generic;
using System.Text;

namespace Lightwell.Managed
{
    /// <summary>Bytes that are not a message of a probe: DataLoss if they are not a message, InvalidArgument, with the
    /// field's name in the message, if the message violates the specification.</summary>
    public sealed class DecodeException : Exception
    {
        public Status Status { get; }

        internal DecodeException(Status status, string message) : base(message) => Status = status;

        /// <summary>For a descriptor that violates the specification.</summary>
        internal static DecodeException Invalid(string what) =>
            new DecodeException(Status.InvalidArgument, "descriptor: " + what);
    }

    internal enum WireType { Varint, Fixed64, Bytes, StartGroup, EndGroup, Fixed32 }

    /// <summary>Position in a message. After Next(), one of the reading methods, or Skip(), consumes the field. A
    /// reading method skips a field of another wire type.</summary>
    internal sealed class WireReader
    {
        /// <summary>Protobuf's limit of nested messages and groups, the outermost message not counted.</summary>
        private const int MaxDepth = 100;

        private readonly byte[] bytes;
        private readonly int end, depth;
        private readonly string what;
        private int at;
        private WireType type;
        private uint number;

        internal WireReader(byte[] bytes, int count, string what) : this(bytes, 0, count, 0, what) { }

        private WireReader(byte[] bytes, int at, int end, int depth, string what)
        {
            this.bytes = bytes;
            this.at = at;
            this.end = end;
            this.depth = depth;
            this.what = what;
        }

        /// <summary>The next field's number; false at the end of the message.</summary>
        internal bool Next(out uint field)
        {
            field = 0;
            if (at >= end) return false;
            var tag = Tag();
            type = (WireType)(tag & 7);
            field = number = tag >> 3;
            return true;
        }

        internal void Skip() => Skip(type, number, depth);

        internal void UInt32(ref uint value)
        {
            if (Is(WireType.Varint)) value = (uint)Varint(10);
        }

        internal void SInt32(ref int value)
        {
            if (Is(WireType.Varint)) value = ZigZag((uint)Varint(10));
        }

        internal void UInt64(ref ulong value)
        {
            if (Is(WireType.Varint)) value = Varint(10);
        }

        internal void Fixed32(ref uint value)
        {
            if (Is(WireType.Fixed32)) value = BitConverter.ToUInt32(bytes, Take(4));
        }

        internal void Fixed64(ref long value)
        {
            if (Is(WireType.Fixed64)) value = BitConverter.ToInt64(bytes, Take(8));
        }

        internal void Float(ref float value)
        {
            if (Is(WireType.Fixed32)) value = BitConverter.ToSingle(bytes, Take(4));
        }

        internal void Double(ref double value)
        {
            if (Is(WireType.Fixed64)) value = BitConverter.ToDouble(bytes, Take(8));
        }

        internal bool Message(out WireReader part)
        {
            part = Is(WireType.Bytes) ? Nested() : null;
            return part != null;
        }

        internal void ByteString(ref byte[] value)
        {
            if (!Is(WireType.Bytes)) return;
            var size = Length();
            value = new byte[size];
            Buffer.BlockCopy(bytes, Take(size), value, 0, size);
        }

        /// <summary>Throws DecodeException for text that is not UTF-8.</summary>
        internal void Text(ref string value)
        {
            byte[] text = null;
            ByteString(ref text);
            if (text == null) return;
            try
            {
                value = new UTF8Encoding(false, true).GetString(text);
            }
            catch (ArgumentException)
            {
                throw NoMessage();
            }
        }

        /// <summary>Packed or not.</summary>
        internal void UInt32s(List<uint> values)
        {
            if (type == WireType.Varint) values.Add((uint)Varint(10));
            else if (Is(WireType.Bytes))
                for (var packed = Nested(); packed.at < packed.end;) values.Add((uint)packed.Varint(10));
        }

        internal void SInt32s(List<int> values)
        {
            if (type == WireType.Varint) values.Add(ZigZag((uint)Varint(10)));
            else if (Is(WireType.Bytes))
                for (var packed = Nested(); packed.at < packed.end;) values.Add(ZigZag((uint)packed.Varint(10)));
        }

        /// <summary>Whether the field has this wire type; skips it if not.</summary>
        private bool Is(WireType expected)
        {
            if (type == expected) return true;
            Skip();
            return false;
        }

        private WireReader Nested()
        {
            var size = Length();
            var start = Take(size);
            return new WireReader(bytes, start, start + size, depth + 1, what);
        }

        private ulong Varint(int limit)
        {
            ulong value = 0;
            for (var k = 0; k < limit; ++k)
            {
                var b = bytes[Take(1)];
                value |= (ulong)(b & 127) << (7 * k);
                if (b < 128) return value;
            }
            throw NoMessage();
        }

        /// <summary>Position of the next `size` bytes, which are consumed.</summary>
        private int Take(int size)
        {
            if (size > end - at) throw NoMessage();
            at += size;
            return at - size;
        }

        private int Length()
        {
            var size = Varint(5);
            if (size > int.MaxValue) throw NoMessage();
            return (int)size;
        }

        private uint Tag()
        {
            var tag = (uint)Varint(5);
            if (tag >> 3 == 0) throw NoMessage();
            return tag;
        }

        private void Skip(WireType skipped, uint field, int level)
        {
            switch (skipped)
            {
                case WireType.Varint: Varint(10); break;
                case WireType.Fixed64: Take(8); break;
                case WireType.Bytes: Take(Length()); break;
                case WireType.Fixed32: Take(4); break;
                case WireType.StartGroup: SkipGroup(field, level); break;
                default: throw NoMessage();
            }
        }

        private void SkipGroup(uint field, int level)
        {
            if (level >= MaxDepth) throw NoMessage();
            for (;;)
            {
                var tag = Tag();
                if ((WireType)(tag & 7) == WireType.EndGroup)
                {
                    if (tag >> 3 != field) throw NoMessage();
                    return;
                }
                Skip((WireType)(tag & 7), tag >> 3, level + 1);
            }
        }

        private DecodeException NoMessage() =>
            new DecodeException(Status.DataLoss, what + ": not a protobuf message");

        private static int ZigZag(uint v) => (int)(v >> 1) ^ -(int)(v & 1);
    }

    /// <summary>Writes protobuf's binary form, as far as requests need it.</summary>
    internal sealed class WireWriter
    {
        private readonly List<byte> bytes = new List<byte>();

        internal WireWriter Fixed32(uint field, uint value)
        {
            Varint(field << 3 | (uint)WireType.Fixed32);
            bytes.AddRange(BitConverter.GetBytes(value));
            return this;
        }

        internal WireWriter Message(uint field, byte[] content)
        {
            Varint(field << 3 | (uint)WireType.Bytes);
            Varint((uint)content.Length);
            bytes.AddRange(content);
            return this;
        }

        internal WireWriter Text(uint field, string text) => Message(field, Encoding.UTF8.GetBytes(text));

        internal byte[] ToArray() => bytes.ToArray();

        private void Varint(uint value)
        {
            for (; value > 127; value >>= 7) bytes.Add((byte)(value & 127 | 128));
            bytes.Add((byte)value);
        }
    }

    internal static class Crc32C
    {
        private static readonly uint[] Table = MakeTable();

        private static uint[] MakeTable()
        {
            var table = new uint[256];
            for (uint i = 0; i < 256; ++i)
            {
                var v = i;
                for (var k = 0; k < 8; ++k) v = (v & 1) != 0 ? v >> 1 ^ 0x82f63b78 : v >> 1;
                table[i] = v;
            }
            return table;
        }

        /// <summary>CRC-32C (Castagnoli), as in RFC 3720 B.4.</summary>
        internal static uint Of(byte[] data)
        {
            var crc = ~0u;
            foreach (var b in data) crc = crc >> 8 ^ Table[(crc ^ b) & 255];
            return ~crc;
        }
    }
}
