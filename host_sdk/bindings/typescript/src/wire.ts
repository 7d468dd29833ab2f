// Reader of protobuf's binary form, as far as descriptors and captured planes need it, as strict as protobuf's own
// parser: unknown fields are ignored, and invalid messages throw.

/** Bytes that are not a message of a probe. `code` as in C++: "data_loss" if they are not a message,
 *  "invalid_argument", with the field's name in the message, if the message violates the specification. */
export class DecodeError extends Error {
  constructor(readonly code: "data_loss" | "invalid_argument", message: string) {
    super(message);
    this.name = "DecodeError";
  }
}

/** Error for a message that violates the specification. */
export function invalid(what: string): DecodeError {
  return new DecodeError("invalid_argument", `descriptor: ${what}`);
}

const enum WireType {
  varint = 0,
  fixed64 = 1,
  bytes = 2,
  startGroup = 3,
  endGroup = 4,
  fixed32 = 5,
}

/** Protobuf's limit of nested messages and groups, the outermost message not counted. */
const maxDepth = 100;

/** Reads the value of a field; false, and nothing is read, if the field has another wire type. */
export type FieldReader = (wire: WireReader) => boolean;

/** Position in a message, after a tag while a field is read. */
export class WireReader {
  type: WireType = WireType.varint;
  readonly view: DataView;

  constructor(
    readonly bytes: Uint8Array, public at = 0, readonly end = bytes.length, private readonly depth = 0,
    private readonly what = "descriptor",
  ) {
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  /** Calls the reader of each field by the field's number; other fields are skipped. */
  fields(readers: { readonly [number: number]: FieldReader }): void {
    while (this.at < this.end) {
      const tag = this.tag();
      this.type = tag & 7;
      if (!readers[tag >>> 3]?.(this)) this.skip(this.type, tag >>> 3, this.depth);
    }
  }

  /** The low 35 bits of a varint of at most `bytes` bytes. */
  varint(bytes = 10): number {
    let value = 0;
    for (let k = 0, unit = 1; k < bytes; ++k, unit *= 128) {
      const byte = this.bytes[this.take(1)];
      if (k < 5) value += (byte & 127) * unit;
      if (byte < 128) return value;
    }
    throw this.noMessage();
  }

  longVarint(): bigint {
    let value = 0n;
    for (let k = 0n; k < 10n; ++k) {
      const byte = this.bytes[this.take(1)];
      value |= BigInt(byte & 127) << (7n * k);
      if (byte < 128) return BigInt.asUintN(64, value);
    }
    throw this.noMessage();
  }

  /** Position of the next `size` bytes, which are consumed. */
  take(size: number): number {
    const start = this.at;
    if (size > this.end - start) throw this.noMessage();
    this.at = start + size;
    return start;
  }

  nested(): WireReader {
    const size = this.length();
    const start = this.take(size);
    return new WireReader(this.bytes, start, start + size, this.depth + 1, this.what);
  }

  private noMessage(): DecodeError {
    return new DecodeError("data_loss", `${this.what}: not a protobuf message`);
  }

  private length(): number {
    const size = this.varint(5);
    if (size >= 2 ** 31) throw this.noMessage();
    return size;
  }

  private tag(): number {
    const tag = this.varint(5) >>> 0;
    if (tag >>> 3 === 0) throw this.noMessage();
    return tag;
  }

  private skip(type: number, number: number, depth: number): void {
    if (type === WireType.varint) this.varint();
    else if (type === WireType.fixed64) this.take(8);
    else if (type === WireType.bytes) this.take(this.length());
    else if (type === WireType.fixed32) this.take(4);
    else if (type === WireType.startGroup) this.skipGroup(number, depth);
    else throw this.noMessage();
  }

  private skipGroup(number: number, depth: number): void {
    if (depth >= maxDepth) throw this.noMessage();
    for (;;) {
      const tag = this.tag();
      if ((tag & 7) === WireType.endGroup) {
        if (tag >>> 3 !== number) throw this.noMessage();
        return;
      }
      this.skip(tag & 7, tag >>> 3, depth + 1);
    }
  }
}

const field = <T>(type: WireType, read: (wire: WireReader) => T) => (set: (value: T) => void): FieldReader =>
  (wire) => {
    if (wire.type !== type) return false;
    set(read(wire));
    return true;
  };

/** Low 32 bits of a varint (uint32, enum). */
export const uint32 = field(WireType.varint, (wire) => wire.varint() >>> 0);
export const sint32 = field(WireType.varint, (wire) => zigzag(wire.varint()));
export const uint64 = field(WireType.varint, (wire) => wire.longVarint());
export const fixed32 = field(WireType.fixed32, (wire) => wire.view.getUint32(wire.take(4), true));
export const fixed64 = field(WireType.fixed64, (wire) => wire.view.getBigUint64(wire.take(8), true));
export const float = field(WireType.fixed32, (wire) => wire.view.getFloat32(wire.take(4), true));
export const double = field(WireType.fixed64, (wire) => wire.view.getFloat64(wire.take(8), true));
export const message = field(WireType.bytes, (wire) => wire.nested());
export const byteString = field(WireType.bytes, (wire) => {
  const part = wire.nested();
  return wire.bytes.subarray(part.at, part.end);
});

/** Packed or not. */
export const repeatedUint32 = (add: (value: number) => void): FieldReader => (wire) => {
  if (wire.type !== WireType.bytes) return uint32(add)(wire);
  const packed = wire.nested();
  while (packed.at < packed.end) add(packed.varint() >>> 0);
  return true;
};
export const repeatedUint64 = (add: (value: bigint) => void): FieldReader => (wire) => {
  if (wire.type !== WireType.bytes) return uint64(add)(wire);
  const packed = wire.nested();
  while (packed.at < packed.end) add(packed.longVarint());
  return true;
};
export const repeatedDouble = (add: (value: number) => void): FieldReader => (wire) => {
  if (wire.type !== WireType.bytes) return double(add)(wire);
  const packed = wire.nested();
  while (packed.at < packed.end) add(packed.view.getFloat64(packed.take(8), true));
  return true;
};
export const repeatedSint32 = (add: (value: number) => void) => repeatedUint32((v) => add(zigzag(v)));

function zigzag(v: number): number {
  return (v >>> 1) ^ -(v & 1);
}

const crcTable = new Uint32Array(256).map((_, i) => {
  let v = i;
  for (let k = 0; k < 8; ++k) v = v & 1 ? (v >>> 1) ^ 0x82f63b78 : v >>> 1;
  return v;
});

/** CRC-32C (Castagnoli), as in RFC 3720 B.4. */
export function crc32c(bytes: Uint8Array): number {
  let crc = ~0;
  for (const b of bytes) crc = (crc >>> 8) ^ crcTable[(crc ^ b) & 255];
  return ~crc >>> 0;
}
