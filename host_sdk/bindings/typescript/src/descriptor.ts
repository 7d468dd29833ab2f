// The lighting descriptor: a probe's estimate at one moment. Wire format: proto/README.md.
//   Descriptor, Light, ErrorBound   values
//   decodeDescriptor                bytes -> Descriptor, fully validated
import { EnvironmentMap, EnvironmentMessage } from "./environment.js";
import { Rgb, Vec3, normalizedFloat } from "./vector.js";
import { DecodeError, WireReader, invalid } from "./wire.js";

export const wireVersion = 1;
export const maxDescriptorBytes = 65536;
export const maxBand = 6;
export const maxLights = 64;

export type Units = "relative" | "absolute";
export type Flag = "unseen" | "clipped" | "cleaned" | "dark" | "moved" | "filled" | "recovered" | "unsure" |
  "newer"; // The probe set a flag that this version does not know.
const wireFlags: readonly Flag[] = ["unseen", "clipped", "cleaned", "dark", "moved", "filled", "recovered", "unsure"];
export type Setting = "fast" | "balanced" | "exact";
export type Flicker = "unknown" | "none" | "100 Hz" | "120 Hz";

/** A detected light (lamp, sun, window), modelled as a spherical cap of uniform radiance. */
export interface Light {
  /** Unit, TOWARDS the light; right-handed, +X right, +Y up, -Z forward. */
  direction: Vec3;
  /** Irradiance at normal incidence, linear Rec. 709. Luminance in lux if units are absolute. */
  irradiance: Rgb;
  /** rad, 0 to pi/2. */
  angularRadius: number;
  /** u·u, u·v, v·v in rad², in the tangent basis of proto/README.md. */
  directionCovariance: Vec3;
  /** Identity over time: the same light keeps its track. 0: not tracked. */
  track: number;
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

/** The lighting of one moment, in the probe's frame. */
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
}

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

class RadianceMessage {
  bands = 0;
  exponent = 0;
  mantissa: number[] = [];

  read(wire: WireReader): void {
    wire.fields((number) => {
      switch (number) {
        case 1:
          return wire.uint32((v) => (this.bands = v));
        case 2:
          return wire.sint32((v) => (this.exponent = v));
        case 3:
          return wire.repeatedSint32((v) => this.mantissa.push(v));
        default:
          return false;
      }
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

  read(wire: WireReader): this {
    wire.fields((number) => {
      switch (number) {
        case 1:
          return wire.repeatedSint32((v) => this.direction.push(v));
        case 2:
          return wire.repeatedSint32((v) => this.irradiance.push(v));
        case 3:
          return wire.sint32((v) => (this.irradianceExponent = v));
        case 4:
          return wire.uint32((v) => (this.radiusE5 = v));
        case 5:
          return wire.repeatedSint32((v) => this.covariance.push(v));
        case 6:
          return wire.uint32((v) => (this.track = v));
        case 7:
          return wire.sint32((v) => (this.covarianceExponent = v));
        default:
          return false;
      }
    });
    return this;
  }

  get(): Light {
    if (this.direction.length !== 3) throw invalid("light.direction needs three numbers");
    if (this.irradiance.length !== 3) throw invalid("light.irradiance_mantissa needs three numbers");
    if (![0, 1, 3].includes(this.covariance.length))
      throw invalid("light.covariance_mantissa needs three numbers, one or none");
    exponentChecked(this.irradianceExponent, "light.irradiance_exponent");
    exponentChecked(this.covarianceExponent, "light.covariance_exponent");
    const direction = normalizedFloat(this.direction.map(fround) as Vec3);
    if (direction === null) throw invalid("light.direction is zero");
    const radius = this.radiusE5 * 1e-5;
    if (radius > Math.PI / 2 + 2e-5) throw invalid("light.angular_radius_e5 is above pi/2");
    const irradiance = this.irradiance.map((m) =>
      valueOf(mantissaChecked(m, mantissaLimit, "light.irradiance_mantissa"), this.irradianceExponent));
    const covariance = this.covariance.map((m) =>
      valueOf(mantissaChecked(m, covarianceLimit, "light.covariance_mantissa"), this.covarianceExponent));
    return {
      direction,
      irradiance: irradiance as Rgb,
      angularRadius: fround(Math.min(radius, Math.PI / 2)),
      directionCovariance: covariance.length === 3 ? (covariance as Vec3) : [covariance[0] ?? 0, 0, covariance[0] ?? 0],
      track: this.track,
    };
  }
}

class Bound {
  private readonly millionths = [0, 0, 0, 0, 0, 0];

  read(wire: WireReader): void {
    wire.fields((number) => number <= 6 && wire.uint32((v) => (this.millionths[number - 1] = v)));
  }

  get(): ErrorBound {
    const [total, truncation, sampling, noise, quantization, smoothing] = this.millionths.map((v) =>
      v === 0xffffffff ? Infinity : fround(v * 1e-6));
    return { total, truncation, sampling, noise, quantization, smoothing };
  }
}

class Time {
  midExposureNs = 0n;
  clock = 0;
  deliveredAfterUs = 0;
  encodedAfterUs = 0;

  read(wire: WireReader): void {
    wire.fields((number) => {
      switch (number) {
        case 1:
          return wire.fixed64((v) => (this.midExposureNs = BigInt.asIntN(64, v)));
        case 2:
          return wire.uint32((v) => (this.clock = v));
        case 3:
          return wire.uint32((v) => (this.deliveredAfterUs = v));
        case 4:
          return wire.uint32((v) => (this.encodedAfterUs = v));
        default:
          return false;
      }
    });
  }
}

function share(v: number, what: string): number {
  if (!(v >= 0 && v <= 1)) throw invalid(`${what} must be 0 to 1`);
  return v;
}

/** Throws DecodeError for bytes that are not a message and for a message that violates the specification; unknown
 *  fields are ignored. */
export function decodeDescriptor(bytes: Uint8Array): Descriptor {
  if (bytes.length > maxDescriptorBytes) throw new DecodeError("data_loss", "descriptor: longer than 64 KiB");
  let version = 0;
  let sequence = 0n;
  let units = 0;
  let unseen = 0;
  let saturated = 0;
  let probeId = 0;
  let calibrationId = 0;
  let setting = 0;
  let flicker = 0;
  const time = new Time();
  const radiance = new RadianceMessage();
  const bound = new Bound();
  const flags = new Set<Flag>();
  const lights: LightMessage[] = [];
  let environment: EnvironmentMessage | null = null;
  // Parse all bytes before validating values, so that a truncated message is data_loss, whatever its content.
  const wire = new WireReader(bytes);
  wire.fields((number) => {
    switch (number) {
      case 1:
        return wire.uint32((v) => (version = v));
      case 2:
        return wire.uint64((v) => (sequence = v));
      case 3:
        return wire.message((part) => time.read(part));
      case 4:
        return wire.uint32((v) => (units = v));
      case 5:
        return wire.message((part) => radiance.read(part));
      case 6:
        return wire.message((part) => lights.push(new LightMessage().read(part)));
      case 7:
        return wire.message((part) => (environment ??= new EnvironmentMessage()).read(part));
      case 8:
        return wire.float((v) => (unseen = v));
      case 9:
        return wire.float((v) => (saturated = v));
      case 10:
        return wire.message((part) => bound.read(part));
      case 11:
        return wire.fixed32((v) => (probeId = v));
      case 12:
        return wire.fixed32((v) => (calibrationId = v));
      case 13:
        return wire.repeatedUint32((v) => flags.add(wireFlags[v - 1] ?? "newer"));
      case 14:
        return wire.uint32((v) => (setting = v));
      case 15:
        return wire.uint32((v) => (flicker = v));
      default:
        return false;
    }
  });
  if (version !== wireVersion) throw invalid(`wire_version is ${version}, this reader knows 1`);
  if (time.clock !== 1) throw invalid("time.clock is not known");
  if (units !== 1 && units !== 2) throw invalid("units are not known");
  if (lights.length > maxLights) throw invalid("more than 64 lights");
  return {
    sequence,
    midExposureNs: time.midExposureNs,
    deliveredAfterUs: time.deliveredAfterUs,
    encodedAfterUs: time.encodedAfterUs,
    units: units === 1 ? "relative" : "absolute",
    ...radiance.get(),
    lights: lights.map((light) => light.get()),
    environment: (environment as EnvironmentMessage | null)?.get() ?? null,
    coverage: share(fround(1 - unseen), "coverage"),
    saturated: share(saturated, "saturated"),
    bound: bound.get(),
    probeId,
    calibrationId,
    flags,
    setting: setting === 1 ? "fast" : setting === 3 ? "exact" : "balanced",
    flicker: flicker === 1 ? "none" : flicker === 2 ? "100 Hz" : flicker === 3 ? "120 Hz" : "unknown",
  };
}
