// A host's requests and the probe's responses: messages of proto/lightwell/v1/link_message.proto.
import { EstimatorState, EstimatorStateMessage, EstimatorUpdate, writeEstimatorUpdate } from "./estimator_config.js";
import {
  CalibrationMessage, InfoMessage, ProbeCalibration, ProbeStatus, RecordingMessage, RecordingStatus, printable, string,
} from "./probe_status.js";
import type { Vec3 } from "./vector.js";
import { DecodeError, WireReader, double, fixed32, message, uint32 } from "./wire.js";
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

export type LinkCommand =
  | { ask: "info" }
  | { ask: "authenticate"; token: string }
  | { ask: "get_config" }
  | { ask: "set_config"; update: EstimatorUpdate }
  | { ask: "report_lux"; lux: number; normal: Vec3 }
  | { ask: "control_recording"; action: "start" | "stop" }
  | { ask: "get_calibration" };

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
  /** Response to get_calibration. */
  calibration?: ProbeCalibration;
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
    case "get_calibration": return out.message(9, () => {}).bytes();
    case "authenticate": return out.message(6, (part) => part.string(1, command.token)).bytes();
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
  let calibration: CalibrationMessage | null = null;
  // Of alternatives the last one counts; parts of the same one are merged.
  const only = (kept: unknown) => {
    if (kept !== info) info = null;
    if (kept !== estimator) estimator = null;
    if (kept !== scale) scale = null;
    if (kept !== recording) recording = null;
    if (kept !== calibration) calibration = null;
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
    10: message((part) => {
      only(calibration ??= new CalibrationMessage());
      (calibration as CalibrationMessage).read(part);
    }),
  });
  if (code !== 0) {
    // An unknown code of a later version is still an error.
    out.error = new ProbeError(statusCodes[code - 1] ?? "internal", printable(text));
    return out;
  }
  if (info) out.info = (info as InfoMessage).get();
  if (scale !== null) out.scale = scale;
  if (calibration) out.calibration = (calibration as CalibrationMessage).get();
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
