// Recordings of descriptors, as written by `lightwell record`. Format: proto/README.md.
import { DecodeError, crc32c } from "./wire.js";
import { WireWriter } from "./wire_writer.js";

export interface RecordedMessage {
  /** CLOCK_MONOTONIC of the recorder at reception, ns. */
  timeNs: bigint;
  bytes: Uint8Array;
}

export interface Recording {
  /** A RecordingHeader message. */
  header: Uint8Array;
  messages: RecordedMessage[];
  /** Bytes after the last complete record. */
  tornBytes: number;
}

const magic = [0x4c, 0x57, 0x52, 0x45, 0x43, 1, 0x0d, 0x0a];

/** Reads all records before the first incomplete or damaged one. Throws DecodeError if the file is not a recording. */
export function readRecording(file: Uint8Array): Recording {
  if (magic.some((byte, i) => file[i] !== byte))
    throw new DecodeError("data_loss", "no Lightwell recording of container version 1");
  const view = new DataView(file.buffer, file.byteOffset, file.byteLength);
  const records: RecordedMessage[] = [];
  let at = magic.length;
  while (file.length - at >= 16) {
    const size = view.getUint32(at, true);
    if (size > file.length - at - 16) break;
    // The checksum is over time and payload, which are contiguous.
    if (crc32c(file.subarray(at + 8, at + 16 + size)) !== view.getUint32(at + 4, true)) break;
    records.push({ timeNs: view.getBigInt64(at + 8, true), bytes: file.subarray(at + 16, at + 16 + size) });
    at += 16 + size;
  }
  const header = records.shift();
  if (header === undefined) throw new DecodeError("data_loss", "the recording has no header");
  return { header: header.bytes, messages: records, tornBytes: file.length - at };
}

/** The first bytes of a recording of descriptors; records follow. `version`: of the program that records. */
export function recordingStart(probeName: string, version: string): Uint8Array {
  const header = encodeRecord({
    timeNs: 0n, bytes: new WireWriter().uint32(1, 1).string(2, probeName).string(3, version).bytes(),
  });
  const out = new Uint8Array(magic.length + header.length);
  out.set(magic);
  out.set(header, magic.length);
  return out;
}

/** One record of a recording. */
export function encodeRecord({ timeNs, bytes }: RecordedMessage): Uint8Array {
  const out = new Uint8Array(16 + bytes.length);
  const view = new DataView(out.buffer);
  view.setUint32(0, bytes.length, true);
  view.setBigInt64(8, timeNs, true);
  out.set(bytes, 16);
  view.setUint32(4, crc32c(out.subarray(8)), true);
  return out;
}
