// Recordings of descriptors and captured planes, as written by `lightwell record`. Format: proto/README.md.
import { DecodeError, WireReader, byteString, crc32c, uint32 } from "./wire.js";
import { WireWriter } from "./wire_writer.js";

export interface RecordedMessage {
  /** CLOCK_MONOTONIC of the recorder at reception, ns. */
  timeNs: bigint;
  /** "unknown": neither a descriptor nor a message of a plane; `bytes` is then the whole record. */
  kind: "descriptor" | "plane" | "unknown";
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
const versionAt = 5;
const newestVersion = 2;
const descriptors = 1;
const descriptorsAndPlanes = 3;

/** The kind of a RecordingHeader. */
function kindOf(header: Uint8Array): number {
  let kind = 0;
  new WireReader(header, 0, header.length, 0, "recording").fields({ 1: uint32((v) => (kind = v)) });
  return kind;
}

/** The message in a MessageRecord; the last one counts if there are several. */
function unwrapped(timeNs: bigint, record: Uint8Array): RecordedMessage {
  let found: RecordedMessage = { timeNs, kind: "unknown", bytes: record };
  const field = (kind: "descriptor" | "plane") => byteString((bytes) => (found = { timeNs, kind, bytes }));
  try {
    new WireReader(record, 0, record.length, 0, "recording").fields({ 1: field("descriptor"), 2: field("plane") });
  } catch (error) {
    if (!(error instanceof DecodeError)) throw error;
    return { timeNs, kind: "unknown", bytes: record };
  }
  return found;
}

/** Reads all records before the first incomplete or damaged one. Throws DecodeError if the file is not a recording of
 *  messages. */
export function readRecording(file: Uint8Array): Recording {
  const differs = (byte: number, i: number) => i !== versionAt && file[i] !== byte;
  if (magic.slice(0, versionAt).some(differs)) throw new DecodeError("data_loss", "no Lightwell recording");
  const version = file[versionAt];
  if (!(version >= 1 && version <= newestVersion))
    throw new DecodeError("data_loss", `container version ${version} is not known; use a newer lightwell`);
  if (magic.some(differs)) throw new DecodeError("data_loss", "damaged by a transfer in text mode");
  const view = new DataView(file.buffer, file.byteOffset, file.byteLength);
  const records: { timeNs: bigint; bytes: Uint8Array }[] = [];
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
  const kind = kindOf(header.bytes);
  if (kind !== descriptors && kind !== descriptorsAndPlanes)
    throw new DecodeError("invalid_argument", "the recording holds no descriptors");
  const messages = records.map(({ timeNs, bytes }): RecordedMessage =>
    kind === descriptors ? { timeNs, kind: "descriptor", bytes } : unwrapped(timeNs, bytes));
  return { header: header.bytes, messages, tornBytes: file.length - at };
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
export function encodeRecord({ timeNs, bytes }: Pick<RecordedMessage, "timeNs" | "bytes">): Uint8Array {
  const out = new Uint8Array(16 + bytes.length);
  const view = new DataView(out.buffer);
  view.setUint32(0, bytes.length, true);
  view.setBigInt64(8, timeNs, true);
  out.set(bytes, 16);
  view.setUint32(4, crc32c(out.subarray(8)), true);
  return out;
}
