// Reader of protobuf's binary form, as far as descriptors need it, as strict as protobuf's own parser: unknown fields
// are ignored, and invalid messages throw.
//   DecodeError   the one error of this module
//   WireReader    the fields of a message

/** Bytes that are not a descriptor. `code` as in C++: "data_loss" if they are not a message, "invalid_argument", with
 *  the field's name in the message, if the message violates the specification. */
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

const noMessage = () => new DecodeError("data_loss", "descriptor: not a protobuf message");

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

/** The value after a tag; read() consumes it, otherwise the reader skips it. */
export class WireReader {
  private at: number;
  private type: WireType = WireType.varint;
  private readonly view: DataView;

  constructor(
    private readonly bytes: Uint8Array, from = 0, private readonly end = bytes.length, private readonly depth = 0,
  ) {
    this.at = from;
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  /** Calls `field(number)` for each field; if it returns false, the field is skipped. */
  fields(field: (number: number) => boolean): void {
    while (this.at < this.end) {
      const tag = this.tag();
      this.type = tag & 7;
      const start = this.at;
      if (!field(tag >>> 3)) {
        this.at = start;
        this.skip(this.type, tag >>> 3, this.depth);
      }
    }
  }

  /** Low 32 bits of a varint (uint32, enum); other wire types are skipped. */
  uint32(set: (value: number) => void): boolean {
    if (this.type !== WireType.varint) return false;
    set(this.varint() >>> 0);
    return true;
  }
  sint32(set: (value: number) => void): boolean {
    return this.uint32((v) => set(zigzag(v)));
  }
  uint64(set: (value: bigint) => void): boolean {
    if (this.type !== WireType.varint) return false;
    set(this.longVarint());
    return true;
  }
  fixed32(set: (value: number) => void): boolean {
    if (this.type !== WireType.fixed32) return false;
    set(this.view.getUint32(this.take(4), true));
    return true;
  }
  fixed64(set: (value: bigint) => void): boolean {
    if (this.type !== WireType.fixed64) return false;
    set(this.view.getBigUint64(this.take(8), true));
    return true;
  }
  float(set: (value: number) => void): boolean {
    if (this.type !== WireType.fixed32) return false;
    set(this.view.getFloat32(this.take(4), true));
    return true;
  }
  /** Packed or not. */
  repeatedUint32(add: (value: number) => void): boolean {
    if (this.type !== WireType.bytes) return this.uint32(add);
    const packed = this.nested();
    while (packed.at < packed.end) add(packed.varint() >>> 0);
    return true;
  }
  repeatedSint32(add: (value: number) => void): boolean {
    return this.repeatedUint32((v) => add(zigzag(v)));
  }
  byteString(set: (value: Uint8Array) => void): boolean {
    if (this.type !== WireType.bytes) return false;
    const part = this.nested();
    set(this.bytes.subarray(part.at, part.end));
    return true;
  }
  message(read: (part: WireReader) => void): boolean {
    if (this.type !== WireType.bytes) return false;
    read(this.nested());
    return true;
  }

  private take(size: number): number {
    const start = this.at;
    if (size > this.end - start) throw noMessage();
    this.at = start + size;
    return start;
  }

  private nested(): WireReader {
    const size = this.length();
    const start = this.take(size);
    return new WireReader(this.bytes, start, start + size, this.depth + 1);
  }

  /** A length below 2^31, in at most five bytes. */
  private length(): number {
    let size = 0;
    for (let k = 0; k < 5; ++k) {
      const byte = this.bytes[this.take(1)];
      if (k === 4 && byte > 7) throw noMessage();
      size |= (byte & 127) << (7 * k);
      if (byte < 128) return size;
    }
    throw noMessage();
  }

  private tag(): number {
    let tag = 0;
    for (let k = 0; k < 5; ++k) {
      const byte = this.bytes[this.take(1)];
      tag = (tag | ((byte & 127) << (7 * k))) >>> 0;
      if (byte < 128) {
        if (tag >>> 3 === 0) throw noMessage();
        return tag;
      }
    }
    throw noMessage();
  }

  /** The low 32 bits, signed. */
  private varint(): number {
    let value = 0;
    for (let k = 0; k < 10; ++k) {
      const byte = this.bytes[this.take(1)];
      if (k < 5) value |= (byte & 127) << (7 * k);
      if (byte < 128) return value;
    }
    throw noMessage();
  }

  private longVarint(): bigint {
    let value = 0n;
    for (let k = 0n; k < 10n; ++k) {
      const byte = this.bytes[this.take(1)];
      value |= BigInt(byte & 127) << (7n * k);
      if (byte < 128) return BigInt.asUintN(64, value);
    }
    throw noMessage();
  }

  private skip(type: number, number: number, depth: number): void {
    switch (type) {
      case WireType.varint:
        this.varint();
        return;
      case WireType.fixed64:
        this.take(8);
        return;
      case WireType.bytes:
        this.take(this.length());
        return;
      case WireType.fixed32:
        this.take(4);
        return;
      case WireType.startGroup:
        this.skipGroup(number, depth);
        return;
      default:
        throw noMessage();
    }
  }

  private skipGroup(number: number, depth: number): void {
    if (depth >= maxDepth) throw noMessage();
    for (;;) {
      const tag = this.tag();
      if ((tag & 7) === WireType.endGroup) {
        if (tag >>> 3 !== number) throw noMessage();
        return;
      }
      this.skip(tag & 7, tag >>> 3, depth + 1);
    }
  }
}

function zigzag(v: number): number {
  return (v >>> 1) ^ -(v & 1);
}
