import { encodeUtf8 } from "./platform.js";

/** Writes protobuf's binary form, as far as requests need it. */
export class WireWriter {
  private readonly out: number[] = [];

  fixed32(field: number, value: number): this {
    this.tag(field, 5);
    for (let k = 0; k < 4; ++k) this.out.push((value >>> (8 * k)) & 255);
    return this;
  }

  /** 0 to 2^32 - 1. */
  uint32(field: number, value: number): this {
    this.tag(field, 0);
    this.varint(value);
    return this;
  }

  double(field: number, value: number): this {
    this.tag(field, 1);
    const view = new DataView(new ArrayBuffer(8));
    view.setFloat64(0, value, true);
    for (let k = 0; k < 8; ++k) this.out.push(view.getUint8(k));
    return this;
  }

  string(field: number, text: string): this {
    return this.byteString(field, encodeUtf8(text));
  }

  message(field: number, fill: (part: WireWriter) => void): this {
    const part = new WireWriter();
    fill(part);
    return this.byteString(field, part.out);
  }

  bytes(): Uint8Array {
    return Uint8Array.from(this.out);
  }

  private byteString(field: number, bytes: ArrayLike<number>): this {
    this.tag(field, 2);
    this.varint(bytes.length);
    for (let k = 0; k < bytes.length; ++k) this.out.push(bytes[k]);
    return this;
  }

  private tag(field: number, type: number): void {
    this.varint(field * 8 + type);
  }

  private varint(value: number): void {
    let rest = value >>> 0;
    for (; rest > 127; rest >>>= 7) this.out.push((rest & 127) | 128);
    this.out.push(rest);
  }
}
