// The light in the few numbers that AR platforms' light estimation gives: as light_estimate.hpp, with the same results.
import { Lighting, Validity } from "./lighting.js";
import { planckian, planckianLocus } from "./planckian_locus.js";
import { toThree } from "./three.js";
import { Rgb, Vec3, luminance } from "./vector.js";

export interface ColorTemperature {
  kelvin: number;
  /** Distance from the Planckian locus in CIE 1960 u, v: positive above it (greenish), negative below (pinkish). */
  duv: number;
}

/** What an application wants to know. Harmonics alone tell least about a room. */
export type LightRequest =
  "ambientIntensity" | "ambientColor" | "ambientSphericalHarmonics" | "mainLightDirection" | "mainLightIntensity";

const everything: readonly LightRequest[] =
  ["ambientIntensity", "ambientColor", "ambientSphericalHarmonics", "mainLightDirection", "mainLightIntensity"];

export interface LightEstimateOptions {
  /** Default: all. */
  requested?: readonly LightRequest[];
  /** Factor on all light, above 0 and finite. Default: 1. */
  gain?: number;
  /** Lux at which intensities are "1000 lumens", above 0 and finite. Default: 1000, lumens are lux. */
  neutralIlluminance?: number;
}

/** null where a value was not requested or there is none. */
export interface LightEstimate {
  /** That of the lighting; "invalid_query" for options that are not allowed. */
  validity: Validity;
  /** ARKit's ambientIntensity: 1000 * meanIlluminance / neutralIlluminance. */
  ambientLumens: number | null;
  /** Mean of the illuminance over all orientations of a surface, lux. */
  meanIlluminance: number | null;
  /** Of all light; null also where a colour temperature has no meaning. */
  colorTemperature: ColorTemperature | null;
  /** Linear, largest channel 1; null for darkness. */
  ambientColor: Rgb | null;
  /** r, g, b of each of nine coefficients of radiance, all signs positive; without the main light if both its direction
   *  and its intensity are requested. */
  ambientSphericalHarmonics: number[] | null;
  /** Towards the main light, unit. */
  mainLightDirection: Vec3 | null;
  /** Linear, largest channel 1. */
  mainLightColor: Rgb | null;
  mainLightLumens: number | null;
}

const maxDuv = 0.05;
const neutralLumens = 1000;
const entries = planckianLocus.length / 2;

/** Linear Rec. 709 to CIE XYZ (IEC 61966-2-1). */
const xyzOfRgb = [
  [0.4123907992659595, 0.3575843393838780, 0.1804807884018343],
  [0.2126390058715104, 0.7151686787677559, 0.0721923153607337],
  [0.0193308187155918, 0.1191947797946259, 0.9505321522496608],
];

/** The point of the locus between entries k and k + 1 that is nearest to (u, v): by Newton's method on the cubic of
 *  Catmull and Rom through entries k - 1 to k + 2. */
function nearestIn(k: number, u: number, v: number): { squared: number; position: number; above: number } {
  const cubic = (offset: number) => {
    const [p, q, r, s] = [k - 1, k, k + 1, k + 2].map((i) => planckianLocus[2 * i + offset]);
    return [q, (r - p) / 2, p - 2.5 * q + 2 * r - 0.5 * s, (3 * (q - r) + s - p) / 2];
  };
  const at = (c: number[], t: number) => c[0] + t * (c[1] + t * (c[2] + t * c[3]));
  const slope = (c: number[], t: number) => c[1] + t * (2 * c[2] + 3 * t * c[3]);
  const [cu, cv] = [cubic(0), cubic(1)];
  let t = 0.5;
  for (let i = 0; i < 8; ++i) {
    const [du, dv, su, sv] = [at(cu, t) - u, at(cv, t) - v, slope(cu, t), slope(cv, t)];
    const curvature = su * su + sv * sv + du * (2 * cu[2] + 6 * t * cu[3]) + dv * (2 * cv[2] + 6 * t * cv[3]);
    if (!(curvature > 0)) break;
    t = Math.min(1, Math.max(0, t - (du * su + dv * sv) / curvature));
  }
  const [pu, pv] = [at(cu, t), at(cv, t)];
  return { squared: (pu - u) ** 2 + (pv - v) ** 2, position: k + t, above: v - pv };
}

/** Correlated colour temperature of a linear Rec. 709 colour; null where it has no meaning: black, more than 0.05 from
 *  the Planckian locus, below 1,000 K or above 100,000 K. Within 0.03 % of the integration of Planck's law. */
export function colorTemperature(color: Rgb): ColorTemperature | null {
  const rgb = color.map(Math.fround);
  const [x, y, z] = xyzOfRgb.map((row) => row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2]);
  const denominator = x + 15 * y + 3 * z;
  if (!(x > 0 && y > 0 && x + y + z > 0 && denominator > 0) || !Number.isFinite(denominator)) return null;
  const [u, v] = [4 * x / denominator, 6 * y / denominator];
  let closest = 0;
  const squared = (i: number) => (planckianLocus[2 * i] - u) ** 2 + (planckianLocus[2 * i + 1] - v) ** 2;
  for (let i = 1; i < entries; ++i) if (squared(i) < squared(closest)) closest = i;
  const k = Math.min(entries - 3, Math.max(2, closest));
  const [below, above] = [nearestIn(k - 1, u, v), nearestIn(k, u, v)];
  const nearest = below.squared < above.squared ? below : above;
  const kelvin = planckian.lowest * planckian.step ** (nearest.position - 1);
  const duv = Math.sqrt(nearest.squared) * (nearest.above < 0 ? -1 : 1);
  return nearest.position > 1 && kelvin <= planckian.highest && Math.abs(duv) <= maxDuv ? { kelvin, duv } : null;
}

/** Mean radiance over the sphere; a cap's is 2 E / (1 + cos rho) over 4 pi. */
function meanRadiance(lighting: Lighting): Rgb {
  const { radiance, lights } = lighting.descriptor!;
  const y00 = 1 / Math.sqrt(4 * Math.PI);
  const sum = radiance[0].map((v) => v * y00) as Rgb;
  for (const light of lights) {
    const weight = 2 / (1 + Math.cos(light.angularRadius)) / (4 * Math.PI);
    for (let k = 0; k < 3; ++k) sum[k] += weight * light.irradiance[k];
  }
  return sum;
}

function pure(c: Rgb): Rgb {
  const largest = Math.max(...c);
  return c.map((v) => Math.max(0, v) / largest) as Rgb;
}

/** The light in a few numbers. */
export function estimateLight(lighting: Lighting, options: LightEstimateOptions = {}): LightEstimate {
  const out: LightEstimate = {
    validity: lighting.validity, ambientLumens: null, meanIlluminance: null, colorTemperature: null, ambientColor: null,
    ambientSphericalHarmonics: null, mainLightDirection: null, mainLightColor: null, mainLightLumens: null,
  };
  const requested = new Set(options.requested ?? everything);
  const gain = Math.fround(options.gain ?? 1);
  const neutral = Math.fround(options.neutralIlluminance ?? 1000);
  const allowed = [gain, neutral].every((v) => v > 0 && Number.isFinite(v)) &&
    [...requested].every((part) => everything.includes(part));
  if (!allowed) return { ...out, validity: "invalid_query" };
  if (lighting.descriptor === null || (out.validity !== "valid" && out.validity !== "stale")) return out;
  const converted = (mainLight: "apart" | "in_harmonics") =>
    toThree(lighting, { mainLight, color: [gain, 0, 0, 0, gain, 0, 0, 0, gain], residual: "left_out" });
  const apart = converted("apart");
  if (apart.validity === "invalid_query") return { ...out, validity: "invalid_query" };
  const mean = meanRadiance(lighting);
  if (requested.has("ambientIntensity")) {
    out.meanIlluminance = Math.max(0, gain * Math.PI * luminance(mean));
    out.ambientLumens = neutralLumens / neutral * out.meanIlluminance;
  }
  if (requested.has("ambientColor") && luminance(mean) > 0) {
    out.ambientColor = pure(mean);
    out.colorTemperature = colorTemperature(mean);
  }
  if (requested.has("ambientSphericalHarmonics")) {
    const both = requested.has("mainLightDirection") && requested.has("mainLightIntensity");
    out.ambientSphericalHarmonics = (both ? apart : converted("in_harmonics")).value.sh;
  }
  const { position, color, intensity } = apart.value;
  if (!(intensity > 0)) return out;
  if (requested.has("mainLightDirection")) out.mainLightDirection = position;
  if (requested.has("mainLightIntensity")) {
    out.mainLightColor = color;
    out.mainLightLumens = neutralLumens / neutral * intensity * luminance(color);
  }
  return out;
}

/** Weight of the light of a probe at an age: 1 up to `holdMs`, 0 after `holdMs + fadeMs`, without kinks between them.
 *  Light with weight * probe + (1 - weight) * own. For light that comes back, 1 - fadeWeight(time since then, 0,
 *  fadeMs). Throws RangeError for a time that is negative or NaN. */
export function fadeWeight(ageMs: number, holdMs = 250, fadeMs = 500): number {
  if (!(holdMs >= 0)) throw new RangeError(`hold: ${holdMs} ms is negative`);
  if (!(fadeMs >= 0)) throw new RangeError(`fade: ${fadeMs} ms is negative`);
  if (ageMs <= holdMs) return 1;
  const t = (ageMs - holdMs) / fadeMs;
  // NaN, of an age that is not known, is no light.
  return t < 1 ? 1 - t * t * (3 - 2 * t) : 0;
}
