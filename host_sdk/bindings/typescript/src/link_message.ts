// A host's requests and the probe's responses: messages of proto/lightwell/v1/link_message.proto.
import { EstimatorState, EstimatorStateMessage, EstimatorUpdate, writeEstimatorUpdate } from "./estimator_config.js";
import { decodeUtf8 } from "./platform.js";
import type { Vec3 } from "./vector.js";
import {
  DecodeError, FieldReader, WireReader, byteString, double, fixed32, fixed64, message, uint32, uint64,
} from "./wire.js";
import { WireWriter } from "./wire_writer.js";

export const maxLinkMessageBytes = 8192;

/** Reasons of a failure, as in C++. */
export type StatusCode = "invalid_argument" | "not_found" | "data_loss" | "failed_precondition" | "unavailable" |
  "resource_exhausted" | "internal";
const statusCodes: readonly StatusCode[] = [
  "invalid_argument", "not_found", "data_loss", "failed_precondition", "unavailable", "resource_exhausted", "internal",
];

/** A failure of a connection or of a request. */
export class ProbeError extends Error {
  constructor(readonly code: StatusCode, text: string) {
    super(text);
    this.name = "ProbeError";
  }
}

/** The probe's counters since its start; meanings: `Counters` of proto/lightwell/v1/probe_service.proto. */
export interface ProbeCounters {
  frames: number;
  capturesDropped: number;
  bracketsIncomplete: number;
  estimates: number;
  estimatesFailed: number;
  descriptorsCoalesced: number;
  clients: number;
  framesRecorded: number;
  recordingFaults: number;
  framesLost: number;
  settingMoves: number;
  estimatesLate: number;
  estimatesLateAtFast: number;
  messagesRefused: number;
  authenticationFailures: number;
  clientListFaults: number;
}
/** In the order of their field numbers, from 1. */
const counterNames: readonly (keyof ProbeCounters)[] = [
  "frames", "capturesDropped", "bracketsIncomplete", "estimates", "estimatesFailed", "descriptorsCoalesced", "clients",
  "framesRecorded", "recordingFaults", "framesLost", "settingMoves", "estimatesLate", "estimatesLateAtFast",
  "messagesRefused", "authenticationFailures", "clientListFaults",
];

/** The probe's own recording: the one that runs, otherwise the last one. */
export interface RecordingStatus {
  running: boolean;
  /** Name in the probe's folder; empty before the first recording. */
  file: string;
  bytes: number;
  descriptors: number;
  /** Messages that came while the probe's disk was too slow, and are missing in the file. */
  lost: number;
  /** Why it ended although no client stopped it: a limit or a fault; otherwise empty. */
  endReason: string;
  /** Recordings that a fault or a limit ended, since the probe's start. */
  faults: number;
}

/** What a probe reports of itself. */
export interface ProbeStatus {
  name: string;
  id: number;
  calibrationId: number;
  /** Firmware version. */
  version: string;
  camera: string;
  counters: ProbeCounters;
  /** null: the probe has no folder for recordings, or firmware that is too old for them. */
  recording: RecordingStatus | null;
}

export type LinkCommand =
  | { ask: "info" }
  | { ask: "authenticate"; token: string }
  | { ask: "get_config" }
  | { ask: "set_config"; update: EstimatorUpdate }
  | { ask: "report_lux"; lux: number; normal: Vec3 }
  | { ask: "control_recording"; action: "start" | "stop" };

export interface LinkResponse {
  id: number;
  /** null: the probe executed the request. */
  error: ProbeError | null;
  info?: { status: ProbeStatus; clockNowNs: bigint };
  /** Response to get_config and set_config. */
  estimator?: EstimatorState;
  /** Response to report_lux: the factor that was applied to radiance. */
  scale?: number;
  /** Response to control_recording: the state after the action. */
  recording?: RecordingStatus;
}

/** A LinkRequest. Throws TypeError for an update that is none. */
export function encodeLinkRequest(id: number, command: LinkCommand): Uint8Array {
  const out = new WireWriter().fixed32(1, id);
  switch (command.ask) {
    case "info": return out.message(2, () => {}).bytes();
    case "set_config":
      return out.message(3, (request) => request.message(1, (config) =>
        config.message(4, (estimator) => writeEstimatorUpdate(command.update, estimator)))).bytes();
    case "report_lux":
      return out.message(4, (report) => {
        report.double(1, command.lux);
        command.normal.forEach((v, k) => report.double(2 + k, v));
      }).bytes();
    case "get_config": return out.message(5, () => {}).bytes();
    case "control_recording":
      return out.message(8, (part) => part.uint32(1, command.action === "start" ? 1 : 2)).bytes();
    case "authenticate": return out.message(6, (part) => part.string(1, command.token)).bytes();
  }
}

const string = (set: (value: string) => void): FieldReader => byteString((bytes) => set(decodeUtf8(bytes)));

class RecordingMessage {
  private readonly status: RecordingStatus =
    { running: false, file: "", bytes: 0, descriptors: 0, lost: 0, endReason: "", faults: 0 };

  read(wire: WireReader): void {
    const { status } = this;
    wire.fields({
      1: uint64((v) => (status.running = v !== 0n)),
      2: string((v) => (status.file = printable(v))),
      3: uint64((v) => (status.bytes = Number(v))),
      4: uint64((v) => (status.descriptors = Number(v))),
      5: uint64((v) => (status.lost = Number(v))),
      6: string((v) => (status.endReason = printable(v))),
      7: uint64((v) => (status.faults = Number(v))),
    });
  }

  get(): RecordingStatus {
    return { ...this.status };
  }
}

class InfoMessage {
  private clockNowNs = 0n;
  private readonly status = { name: "", id: 0, calibrationId: 0, version: "", camera: "" };
  private recording: RecordingMessage | null = null;
  private readonly counters = Object.fromEntries(counterNames.map((name) => [name, 0])) as unknown as ProbeCounters;

  read(wire: WireReader): void {
    const { status, counters } = this;
    wire.fields({
      1: string((v) => (status.name = v)),
      2: fixed32((v) => (status.id = v)),
      3: fixed32((v) => (status.calibrationId = v)),
      4: string((v) => (status.version = v)),
      5: string((v) => (status.camera = v)),
      6: fixed64((v) => (this.clockNowNs = BigInt.asIntN(64, v))),
      7: message((part) => part.fields(Object.fromEntries(counterNames.map((name, k) =>
        [k + 1, uint64((v) => (counters[name] = Number(v)))])))),
      9: message((part) => (this.recording ??= new RecordingMessage()).read(part)),
    });
  }

  get() {
    const recording = this.recording?.get() ?? null;
    return { status: { ...this.status, counters: this.counters, recording }, clockNowNs: this.clockNowNs };
  }
}

/** Throws DecodeError with code data_loss for bytes that are not a LinkResponse. */
export function decodeLinkResponse(bytes: Uint8Array): LinkResponse {
  const noResponse = () => new DecodeError("data_loss", "not a LinkResponse");
  if (bytes.length > maxLinkMessageBytes) throw noResponse();
  try {
    return decoded(bytes);
  } catch (cause) {
    // TypeError: text that is not UTF-8.
    if (cause instanceof DecodeError || cause instanceof TypeError) throw noResponse();
    throw cause;
  }
}

function decoded(bytes: Uint8Array): LinkResponse {
  const out: LinkResponse = { id: 0, error: null };
  let code = 0;
  let text = "";
  let info: InfoMessage | null = null;
  let estimator: EstimatorStateMessage | null = null;
  let scale: number | null = null;
  let recording: RecordingMessage | null = null;
  // Of alternatives the last one counts; parts of the same one are merged.
  const only = (kept: unknown) => {
    if (kept !== info) info = null;
    if (kept !== estimator) estimator = null;
    if (kept !== scale) scale = null;
    if (kept !== recording) recording = null;
  };
  new WireReader(bytes).fields({
    1: fixed32((v) => (out.id = v)),
    2: uint32((v) => (code = v)),
    3: string((v) => (text = v)),
    4: message((part) => {
      only(info ??= new InfoMessage());
      (info as InfoMessage).read(part);
    }),
    5: message((part) => part.fields({ 2: message((now) => {
      only(estimator ??= new EstimatorStateMessage());
      (estimator as EstimatorStateMessage).read(now);
    }) })),
    6: message((part) => {
      only(scale ??= 0);
      part.fields({ 1: double((v) => (scale = v)) });
    }),
    7: message((part) => {
      only(estimator ??= new EstimatorStateMessage());
      (estimator as EstimatorStateMessage).read(part);
    }),
    9: message((part) => {
      const control = (recording ??= new RecordingMessage());
      only(control);
      part.fields({ 1: message((status) => control.read(status)) });
    }),
  });
  if (code !== 0) {
    // An unknown code of a later version is still an error.
    out.error = new ProbeError(statusCodes[code - 1] ?? "internal", printable(text));
    return out;
  }
  if (info) out.info = (info as InfoMessage).get();
  if (scale !== null) out.scale = scale;
  if (recording) out.recording = (recording as RecordingMessage).get();
  if (estimator)
    try {
      out.estimator = (estimator as EstimatorStateMessage).get();
    } catch (cause) {
      if (!(cause instanceof DecodeError)) throw cause;
      out.error = new ProbeError("data_loss", cause.message);
    }
  return out;
}

/** Text of a peer without control characters, at most 500 characters. */
export function printable(text: string): string {
  return text.slice(0, 500).replace(/[\u0000-\u001f\u007f-\u009f\u2028\u2029]/g, "?");
}
