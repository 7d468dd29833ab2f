// The lighting descriptor: a probe's estimate at one moment. Wire format: proto/README.md.
//   Descriptor, Light, ErrorBound   values
//   decodeDescriptor                bytes -> Descriptor, fully validated
import { EnvironmentMap, EnvironmentMessage } from "./environment.js";
import { settings } from "./estimator_config.js";
import { PoseMessage } from "./pose_message.js";
import { Pose, Rgb, Vec3, normalized } from "./vector.js";
import {
  DecodeError, WireReader, fixed32, fixed64, float, invalid, message, repeatedSint32, repeatedUint32, sint32, uint32,
  uint64,
} from "./wire.js";

export const wireVersion = 1;
export const maxDescriptorBytes = 65536;
export const maxBand = 6;
export const maxLights = 64;

export type Units = "relative" | "absolute";
export type Flag = "unseen" | "clipped" | "cleaned" | "dark" | "moved" | "filled" | "recovered" | "unsure" |
  "newer"; // The probe set a flag that this version does not know.
const wireFlags: readonly Flag[] = ["unseen", "clipped", "cleaned", "dark", "moved", "filled", "recovered", "unsure"];
export type Setting = "fastest" | "fast" | "balanced" | "exact";
export type Flicker = "unknown" | "none" | "100 Hz" | "120 Hz";
const flickers: readonly Flicker[] = ["unknown", "none", "100 Hz", "120 Hz"];

/** A detected light (lamp, sun, window), modelled as a spherical cap of uniform radiance. */
export interface Light {
  /** Unit, TOWARDS the light; right-handed, +X right, +Y up, -Z forward. */
  direction: Vec3;
  /** Irradiance at normal incidence, linear Rec. 709. Luminance in lux if units are absolute. */
  irradiance: Rgb;
  /** rad, 0 to pi/2. */
  angularRadius: number;
  /** u·u, u·v, v·v in rad², in the tangent basis of proto/README.md. Positive semi-definite. */
  directionCovariance: Vec3;
  /** Identity over time: the same light keeps its track. 0: not tracked. */
  track: number;
  /** From the descriptor's origin, m. 0: distant or not known. */
  distance: number;
  /** Standard deviation of the distance, m. */
  distanceSigma: number;
  /** In the probe's frame, m: the origin's translation plus distance times direction; null if that is not known. */
  position: Vec3 | null;
}

/** Bound of the irradiance error, RMS over normals relative to the RMS irradiance: 0.01 is 1 %. Infinite where no bound
 *  exists; the flags give the reason. */
export interface ErrorBound {
  total: number;
  truncation: number;
  sampling: number;
  noise: number;
  quantization: number;
  smoothing: number;
}

/** The lighting of one moment: at the origin, in the probe's axes. */
export interface Descriptor {
  sequence: bigint;
  /** Mid-exposure in the probe's CLOCK_MONOTONIC, ns. */
  midExposureNs: bigint;
  deliveredAfterUs: number;
  encodedAfterUs: number;
  units: Units;
  /** Highest band of `radiance`. */
  band: number;
  /** Spherical harmonics of the radiance without the lights: real, orthonormal, WITHOUT the Condon-Shortley phase, in
   *  the order l(l+1)+m, (band+1)² of them. */
  radiance: Rgb[];
  /** Strongest first. */
  lights: Light[];
  /** For reflections: a whole map or changes to one; null in most messages. EnvironmentKeeper assembles them. */
  environment: EnvironmentMap | null;
  /** Fraction of the sphere that at least one pixel sees. */
  coverage: number;
  /** Fraction of the seen part that is saturated in every exposure. */
  saturated: number;
  bound: ErrorBound;
  probeId: number;
  calibrationId: number;
  /** Conditions under which the estimate may be wrong. */
  flags: ReadonlySet<Flag>;
  setting: Setting;
  flicker: Flicker;
  /** T_probe_origin: the light holds at its translation; for a marker its rotation is that of the body's axes. It turns
   *  no direction. The identity: the origin is the probe. */
  origin: Pose;
}

const identity: Pose = { rotation: [0, 0, 0, 1], translation: [0, 0, 0] };
const mantissaLimit = 8191;
const covarianceLimit = 63;
const fround = Math.fround;

function exponentChecked(e: number, what: string): number {
  if (e < -150 || e > 100) throw invalid(`${what} is out of range`);
  return e;
}

function mantissaChecked(m: number, limit: number, what: string): number {
  if (Math.abs(m) > limit) throw invalid(`${what} is larger than ${limit}`);
  return m;
}

function valueOf(mantissa: number, exponent: number): number {
  return fround(mantissa * 2 ** exponent);
}

/** The positive semi-definite matrix uu, uv, vv that is nearest in the Frobenius norm: negative eigenvalues become zero
 *  (Higham 1988, "Computing a nearest symmetric positive semidefinite matrix", theorem 2.1). */
function nearestPositiveSemidefinite([uu, uv, vv]: Vec3): Vec3 {
  if (uu >= 0 && vv >= 0 && uv * uv <= uu * vv) return [uu, uv, vv];
  const h = (uu - vv) / 2;
  const r = Math.sqrt(h * h + uv * uv);
  const largest = (uu + vv) / 2 + r; // Eigenvalue.
  if (!(largest > 0)) return [0, 0, 0];
  return [(largest * (r + h)) / (2 * r), (largest * uv) / (2 * r), (largest * (r - h)) / (2 * r)];
}

/** The covariance uu, uv, vv of a message, rounded to float and positive semi-definite. */
function covarianceOf(mantissa: Vec3, exponent: number): Vec3 {
  const m = new Float32Array(nearestPositiveSemidefinite(mantissa).map((v) => v * 2 ** exponent));
  const bits = new Uint32Array(m.buffer);
  // Rounding to float may make uv too large. One less in its bits is the next float towards zero.
  while (m[1] * m[1] > m[0] * m[2]) --bits[1];
  return [m[0], m[1], m[2]];
}

class RadianceMessage {
  bands = 0;
  exponent = 0;
  mantissa: number[] = [];

  read(wire: WireReader): void {
    wire.fields({
      1: uint32((v) => (this.bands = v)),
      2: sint32((v) => (this.exponent = v)),
      3: repeatedSint32((v) => this.mantissa.push(v)),
    });
  }

  get(): { band: number; radiance: Rgb[] } {
    if (this.bands >= 1 << (maxBand + 1)) throw invalid("radiance.bands has a band above 6");
    let needed = 0;
    for (let l = 0; l <= maxBand; ++l) if ((this.bands >> l) & 1) needed += 3 * (2 * l + 1);
    if (this.mantissa.length !== needed)
      throw invalid(`radiance.mantissa has ${this.mantissa.length} numbers, its bands need ${needed}`);
    exponentChecked(this.exponent, "radiance.exponent");
    const band = this.bands === 0 ? 0 : 31 - Math.clz32(this.bands);
    const radiance: Rgb[] = [];
    let next = 0;
    for (let l = 0; l <= band; ++l)
      for (let m = -l; m <= l; ++m) {
        const c: Rgb = [0, 0, 0];
        if ((this.bands >> l) & 1)
          for (let k = 0; k < 3; ++k)
            c[k] = valueOf(mantissaChecked(this.mantissa[next++], mantissaLimit, "radiance.mantissa"), this.exponent);
        radiance.push(c);
      }
    return { band, radiance };
  }
}

class LightMessage {
  private readonly direction: number[] = [];
  private readonly irradiance: number[] = [];
  private readonly covariance: number[] = [];
  private irradianceExponent = 0;
  private covarianceExponent = 0;
  private radiusE5 = 0;
  private track = 0;
  private distanceE4 = 0;
  private distanceSigmaE4 = 0;

  read(wire: WireReader): this {
    wire.fields({
      1: repeatedSint32((v) => this.direction.push(v)),
      2: repeatedSint32((v) => this.irradiance.push(v)),
      3: sint32((v) => (this.irradianceExponent = v)),
      4: uint32((v) => (this.radiusE5 = v)),
      5: repeatedSint32((v) => this.covariance.push(v)),
      6: uint32((v) => (this.track = v)),
      7: sint32((v) => (this.covarianceExponent = v)),
      8: uint32((v) => (this.distanceE4 = v)),
      9: uint32((v) => (this.distanceSigmaE4 = v)),
    });
    return this;
  }

  get(origin: Pose): Light {
    if (this.direction.length !== 3) throw invalid("light.direction needs three numbers");
    if (this.irradiance.length !== 3) throw invalid("light.irradiance_mantissa needs three numbers");
    if (![0, 1, 3].includes(this.covariance.length))
      throw invalid("light.covariance_mantissa needs three numbers, one or none");
    exponentChecked(this.irradianceExponent, "light.irradiance_exponent");
    exponentChecked(this.covarianceExponent, "light.covariance_exponent");
    const direction = normalized(this.direction.map(fround) as Vec3, fround);
    if (direction === null) throw invalid("light.direction is zero");
    const radius = this.radiusE5 * 1e-5;
    if (radius > Math.PI / 2 + 2e-5) throw invalid("light.angular_radius_e5 is above pi/2");
    const irradiance = this.irradiance.map((m) =>
      valueOf(mantissaChecked(m, mantissaLimit, "light.irradiance_mantissa"), this.irradianceExponent));
    const [uu, uv, vv] = this.covariance.map((m) => mantissaChecked(m, covarianceLimit, "light.covariance_mantissa"));
    if ((this.distanceE4 === 0) !== (this.distanceSigmaE4 === 0))
      throw invalid("light.distance_e4 without distance_sigma_e4, or the reverse");
    const distance = fround(this.distanceE4 * 1e-4);
    const unit = normalized(direction)!;
    return {
      direction,
      irradiance: irradiance as Rgb,
      angularRadius: fround(Math.min(radius, Math.PI / 2)),
      directionCovariance: covarianceOf([uu ?? 0, uv ?? 0, vv ?? uu ?? 0], this.covarianceExponent),
      track: this.track,
      distance,
      distanceSigma: fround(this.distanceSigmaE4 * 1e-4),
      position: distance > 0 ? (origin.translation.map((v, k) => v + unit[k] * distance) as Vec3) : null,
    };
  }
}

function boundOf(millionths: readonly number[]): ErrorBound {
  const [total, truncation, sampling, noise, quantization, smoothing] = millionths.map((v) =>
    v === 0xffffffff ? Infinity : fround(v * 1e-6));
  return { total, truncation, sampling, noise, quantization, smoothing };
}

function share(v: number, what: string): number {
  if (!(v >= 0 && v <= 1)) throw invalid(`${what} must be 0 to 1`);
  return v;
}

/** Throws DecodeError for bytes that are not a message and for a message that violates the specification; unknown
 *  fields are ignored. */
export function decodeDescriptor(bytes: Uint8Array): Descriptor {
  if (bytes.length > maxDescriptorBytes) throw new DecodeError("data_loss", "descriptor: longer than 64 KiB");
  // Members of the descriptor as they are in the message, and numbers that are interpreted below.
  const plain = {
    sequence: 0n, midExposureNs: 0n, deliveredAfterUs: 0, encodedAfterUs: 0, probeId: 0, calibrationId: 0,
  };
  const raw = { version: 0, clock: 0, units: 0, unseen: 0, saturated: 0, setting: 0, flicker: 0 };
  const millionths = [0, 0, 0, 0, 0, 0];
  const radiance = new RadianceMessage();
  const flags = new Set<Flag>();
  const lights: LightMessage[] = [];
  let environment: EnvironmentMessage | null = null;
  let pose: PoseMessage | null = null;
  // Parse all bytes before validating values, so that a truncated message is data_loss, whatever its content.
  new WireReader(bytes).fields({
    1: uint32((v) => (raw.version = v)),
    2: uint64((v) => (plain.sequence = v)),
    3: message((time) => time.fields({
      1: fixed64((v) => (plain.midExposureNs = BigInt.asIntN(64, v))),
      2: uint32((v) => (raw.clock = v)),
      3: uint32((v) => (plain.deliveredAfterUs = v)),
      4: uint32((v) => (plain.encodedAfterUs = v)),
    })),
    4: uint32((v) => (raw.units = v)),
    5: message((part) => radiance.read(part)),
    6: message((part) => lights.push(new LightMessage().read(part))),
    7: message((part) => (environment ??= new EnvironmentMessage()).read(part)),
    8: float((v) => (raw.unseen = v)),
    9: float((v) => (raw.saturated = v)),
    10: message((bound) =>
      bound.fields(Object.fromEntries(millionths.map((_, i) => [i + 1, uint32((v) => (millionths[i] = v))])))),
    11: fixed32((v) => (plain.probeId = v)),
    12: fixed32((v) => (plain.calibrationId = v)),
    13: repeatedUint32((v) => flags.add(wireFlags[v - 1] ?? "newer")),
    14: uint32((v) => (raw.setting = v)),
    15: uint32((v) => (raw.flicker = v)),
    16: message((part) => (pose ??= new PoseMessage()).read(part)),
  });
  if (raw.version !== wireVersion) throw invalid(`wire_version is ${raw.version}, this reader knows 1`);
  if (raw.clock !== 1) throw invalid("time.clock is not known");
  if (raw.units !== 1 && raw.units !== 2) throw invalid("units are not known");
  if (lights.length > maxLights) throw invalid("more than 64 lights");
  const origin = (pose as PoseMessage | null)?.get("T_probe_origin", invalid) ?? identity;
  return {
    ...plain,
    units: raw.units === 1 ? "relative" : "absolute",
    ...radiance.get(),
    lights: lights.map((light) => light.get(origin)),
    environment: (environment as EnvironmentMessage | null)?.get() ?? null,
    coverage: fround(1 - share(raw.unseen, "unseen (1 - coverage)")),
    saturated: share(raw.saturated, "saturated"),
    bound: boundOf(millionths),
    flags,
    setting: settings[raw.setting - 1] ?? "balanced",
    flicker: flickers[raw.flicker] ?? "unknown",
    origin,
  };
}
