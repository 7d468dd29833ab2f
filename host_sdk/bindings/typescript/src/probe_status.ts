// What a probe reports of itself: messages of proto/lightwell/v1/probe_service.proto.
import { decodeUtf8 } from "./platform.js";
import { PoseMessage } from "./pose_message.js";
import type { Pose } from "./vector.js";
import {
  DecodeError, FieldReader, WireReader, byteString, double, fixed32, fixed64, float, message, repeatedDouble, uint32,
  uint64,
} from "./wire.js";

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

/** One link of the probe; counters since the probe's start. */
export interface LinkStatus {
  /** "grpc", "web", "usb_gadget" or "mqtt". */
  name: string;
  clients: number;
  descriptorsCoalesced: number;
  messagesRefused: number;
  authenticationFailures: number;
  /** It has a fault now; the probe's log says which. */
  fault: boolean;
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
  /** Of the hottest thermal zone of the probe's machine, degrees Celsius; null without a sensor. */
  temperatureC: number | null;
  /** At most eight; empty with older firmware. */
  links: LinkStatus[];
  /** T_world_probe: pose of the probe in its room; null if it does not know (`lightwelld --mounting`). */
  mounting: Pose | null;
}

/** What the probe's calibration covers, and how well. */
export interface ProbeCalibration {
  id: number;
  /** Name without folder; empty: the camera's own calibration. */
  file: string;
  /** cd/m² of a pixel value are known. */
  absolute: boolean;
  lenses: LensSummary[];
  /** null: the file has none. */
  report: CalibrationReport | null;
}

export interface LensSummary {
  /** Of the picture that the calibration is for, px. */
  width: number;
  height: number;
  /** Its name in calibration.proto: "kannala_brandt". */
  model: string;
  /** Half the field of view. */
  maxAngleDeg: number;
  response: "linear" | "srgb" | "table" | "gamma" | "unknown";
  /** Vignetting is corrected. */
  vignetting: boolean;
  /** Read or shot noise is known. */
  noise: boolean;
}

/** How a calibration was measured. Times: seconds since 1970, 0: not known. */
export interface CalibrationReport {
  geometryTimeS: number;
  /** RMS of the residuals of both coordinates, px. */
  rmsPx: number;
  points: number;
  /** For each lens: the largest angle from its axis at which boards were seen. */
  seenDeg: number[];
  /** For each lens: largest uncertainty of a direction up to there, three standard deviations. */
  direction3SigmaDeg: number[];
  photometryTimeS: number;
}

const maxLinks = 8;
const maxLenses = 2;

/** Text of a peer without control characters, at most 500 characters. */
export function printable(text: string): string {
  return text.slice(0, 500).replace(/[\u0000-\u001f\u007f-\u009f\u2028\u2029]/g, "?");
}

export const string = (set: (value: string) => void): FieldReader => byteString((bytes) => set(decodeUtf8(bytes)));
const count = (set: (value: number) => void) => uint64((v) => set(Number(v)));
const flag = (set: (value: boolean) => void) => uint64((v) => set(v !== 0n));

export class RecordingMessage {
  private readonly status: RecordingStatus =
    { running: false, file: "", bytes: 0, descriptors: 0, lost: 0, endReason: "", faults: 0 };

  read(wire: WireReader): void {
    const { status } = this;
    wire.fields({
      1: flag((v) => (status.running = v)),
      2: string((v) => (status.file = printable(v))),
      3: count((v) => (status.bytes = v)),
      4: count((v) => (status.descriptors = v)),
      5: count((v) => (status.lost = v)),
      6: string((v) => (status.endReason = printable(v))),
      7: count((v) => (status.faults = v)),
    });
  }

  get(): RecordingStatus {
    return { ...this.status };
  }
}

function readLink(wire: WireReader): LinkStatus {
  const link: LinkStatus =
    { name: "", clients: 0, descriptorsCoalesced: 0, messagesRefused: 0, authenticationFailures: 0, fault: false };
  wire.fields({
    1: string((v) => (link.name = printable(v))),
    2: uint32((v) => (link.clients = v)),
    3: count((v) => (link.descriptorsCoalesced = v)),
    4: count((v) => (link.messagesRefused = v)),
    5: count((v) => (link.authenticationFailures = v)),
    6: flag((v) => (link.fault = v)),
  });
  return link;
}

/** An InfoResponse. */
export class InfoMessage {
  private clockNowNs = 0n;
  private readonly status = {
    name: "", id: 0, calibrationId: 0, version: "", camera: "", temperatureC: null as number | null,
    links: [] as LinkStatus[],
  };
  private recording: RecordingMessage | null = null;
  private mounting: PoseMessage | null = null;
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
        [k + 1, count((v) => (counters[name] = v))])))),
      8: message((part) => {
        const pose = (this.mounting ??= new PoseMessage());
        part.fields({ 1: message((value) => pose.read(value)), 2: repeatedDouble(() => {}) });
      }),
      9: message((part) => (this.recording ??= new RecordingMessage()).read(part)),
      10: float((v) => (status.temperatureC = v)),
      11: message((part) => {
        const link = readLink(part);
        if (status.links.length < maxLinks) status.links.push(link);
      }),
    });
  }

  get(): { status: ProbeStatus; clockNowNs: bigint } {
    const recording = this.recording?.get() ?? null;
    const { counters, clockNowNs } = this;
    return { status: { ...this.status, counters, recording, mounting: this.mountingPose() }, clockNowNs };
  }

  /** As in C++, an invalid mounting is dropped. */
  private mountingPose(): Pose | null {
    try {
      return this.mounting?.get("mounting", (problem) => new DecodeError("invalid_argument", problem)) ?? null;
    } catch {
      return null;
    }
  }
}

const responses = ["linear", "srgb", "table", "gamma"] as const;

function readLens(wire: WireReader): LensSummary {
  const lens: LensSummary =
    { width: 0, height: 0, model: "", maxAngleDeg: 0, response: "linear", vignetting: false, noise: false };
  wire.fields({
    1: uint32((v) => (lens.width = v)),
    2: uint32((v) => (lens.height = v)),
    3: string((v) => (lens.model = printable(v))),
    4: double((v) => (lens.maxAngleDeg = v)),
    5: uint32((v) => (lens.response = responses[v] ?? "unknown")),
    6: flag((v) => (lens.vignetting = v)),
    7: flag((v) => (lens.noise = v)),
  });
  return lens;
}

/** A GetCalibrationResponse. */
export class CalibrationMessage {
  private readonly calibration: ProbeCalibration = { id: 0, file: "", absolute: false, lenses: [], report: null };

  read(wire: WireReader): void {
    const { calibration } = this;
    wire.fields({
      1: fixed32((v) => (calibration.id = v)),
      2: string((v) => (calibration.file = printable(v))),
      3: flag((v) => (calibration.absolute = v)),
      4: message((part) => {
        const lens = readLens(part);
        if (calibration.lenses.length < maxLenses) calibration.lenses.push(lens);
      }),
      5: message((part) => this.readReport(part)),
    });
  }

  private readReport(wire: WireReader): void {
    const report = (this.calibration.report ??=
      { geometryTimeS: 0, rmsPx: 0, points: 0, seenDeg: [], direction3SigmaDeg: [], photometryTimeS: 0 });
    wire.fields({
      1: uint64((v) => (report.geometryTimeS = Number(BigInt.asIntN(64, v)))),
      2: double((v) => (report.rmsPx = v)),
      3: uint32((v) => (report.points = v)),
      4: repeatedDouble((v) => report.seenDeg.push(v)),
      5: repeatedDouble((v) => report.direction3SigmaDeg.push(v)),
      6: uint64((v) => (report.photometryTimeS = Number(BigInt.asIntN(64, v)))),
    });
  }

  get(): ProbeCalibration {
    return this.calibration;
  }
}
