// Light for three.js: a LightProbe and a DirectionalLight. What conventions.hpp gives, computed here.
//
//   const { value, residual } = toThree(light);
//   lightProbe.sh.fromArray(value.sh);
//   lightProbe.intensity = value.lightProbeIntensity;
//   sun.position.fromArray(value.position);               // its target at the origin
//   sun.color.setRGB(...value.color);                     // linear
//   sun.intensity = value.intensity;
import { Lighting, Validity } from "./lighting.js";
import { capIrradiance, capZonal, cosineLobe, harmonicsBasis } from "./lobes.js";
import { Rgb, Vec3, dot, luminance, normalized } from "./vector.js";

export interface ThreeOptions {
  /** What three.js multiplies direct light by: "physical" from r155 on, "legacy" where useLegacyLights is true. */
  lights?: "physical" | "legacy";
  /** Where the strongest light goes: into a DirectionalLight, or nowhere but into the LightProbe. */
  mainLight?: "apart" | "in_harmonics";
  /** A matrix, row by row, applied to every colour: for exposure and white point. Default: none, cd/m² and lux. */
  color?: readonly number[];
  residual?: "measured" | "left_out";
}

/** three.js's axes are ours. Without an estimate the intensities are 0. */
export interface ThreeLighting {
  /** LightProbe.sh.fromArray(sh): r, g, b of each of nine coefficients of radiance. */
  sh: number[];
  lightProbeIntensity: number;
  /** DirectionalLight.position: towards the light; unit. */
  position: Vec3;
  /** Linear, largest channel 1. */
  color: Rgb;
  intensity: number;
}

export interface ConvertedToThree {
  value: ThreeLighting;
  /** Of the Lighting; "invalid_query" for a matrix that is none. */
  validity: Validity;
  /** Error of the irradiance by what three.js cannot hold (bands above 2, how wide the main light is): RMS over 512
   *  normals relative to the RMS irradiance. null where it was not worked out. */
  residual: number | null;
}

const residualNormals = 512;
const largest = 3.4028234663852886e38 / 1e4;
const bandOf = (i: number) => (i === 0 ? 0 : i < 4 ? 1 : 2);

interface Lamp {
  towards: Vec3;
  irradiance: Rgb;
  radius: number;
}

function mapped(color: readonly number[], c: Rgb): Rgb {
  const row = (i: number) => color[3 * i] * c[0] + color[3 * i + 1] * c[1] + color[3 * i + 2] * c[2];
  return [row(0), row(1), row(2)];
}

function add(sum: Rgb, c: Rgb, factor: number): void {
  for (let k = 0; k < 3; ++k) sum[k] += factor * c[k];
}

function none(validity: Validity): ConvertedToThree {
  const value: ThreeLighting = {
    sh: new Array<number>(27).fill(0), lightProbeIntensity: 0, position: [0, 1, 0], color: [1, 1, 1], intensity: 0,
  };
  return { value, validity, residual: null };
}

/** A sphere lit by three.js with these numbers is lit as Lighting.irradiance says, but for the residual. The main
 *  light, where it is apart, is in the harmonics no more; of a wide one they hold what a light from one direction does
 *  not reproduce. */
export function toThree(lighting: Lighting, options: ThreeOptions = {}): ConvertedToThree {
  const { descriptor } = lighting;
  if (descriptor === null || (lighting.validity !== "valid" && lighting.validity !== "stale"))
    return none(lighting.validity);
  const color = (options.color ?? [1, 0, 0, 0, 1, 0, 0, 0, 1]).map(Math.fround);
  if (color.length !== 9 || !color.every(Number.isFinite)) return none("invalid_query");
  const lamps = descriptor.lights.map((light): Lamp => ({
    towards: normalized(light.direction)!,
    irradiance: mapped(color, light.irradiance),
    radius: light.angularRadius,
  }));
  const kept = Array.from({ length: 9 }, (_, i): Rgb =>
    i < descriptor.radiance.length ? mapped(color, descriptor.radiance[i]) : [0, 0, 0]);
  const main = options.mainLight === "in_harmonics" ? null : mainOf(lamps);
  for (const lamp of lamps) {
    const basis = harmonicsBasis(2, lamp.towards);
    kept.forEach((sum, i) => add(sum, lamp.irradiance, basis[i] * capZonal(bandOf(i), lamp.radius)));
    // three.js adds it as a point: what that is in bands 0 to 2 is taken out again.
    if (lamp === main?.lamp) kept.forEach((sum, i) => add(sum, main.irradiance, -basis[i]));
  }
  if (![...kept, ...(main ? [main.irradiance] : [])].every((c) => c.every((v) => Math.abs(v) <= largest)))
    return none("invalid_query");
  const out = none(lighting.validity);
  out.value.sh = kept.flat();
  out.value.lightProbeIntensity = 1;
  if (main) {
    const most = Math.max(...main.irradiance);
    out.value.position = main.lamp.towards;
    out.value.color = main.irradiance.map((v) => v / most) as Rgb;
    out.value.intensity = options.lights === "legacy" ? most / Math.PI : most;
  }
  if (options.residual !== "left_out") out.residual = residualOf(lighting, lamps, color, kept, main);
  return out;
}

interface Main {
  lamp: Lamp;
  /** No channel is negative. */
  irradiance: Rgb;
}

function mainOf(lamps: readonly Lamp[]): Main | null {
  if (lamps.length === 0) return null;
  const lamp = lamps.reduce((a, b) => (luminance(b.irradiance) > luminance(a.irradiance) ? b : a));
  const irradiance = lamp.irradiance.map((v) => Math.max(0, v)) as Rgb;
  return Math.max(...irradiance) > 0 ? { lamp, irradiance } : null;
}

/** Even over the sphere: rings of equal area, each turned by the golden angle. */
function fibonacci(i: number): Vec3 {
  const z = 1 - (2 * i + 1) / residualNormals;
  const s = Math.sqrt((1 - z) * (1 + z));
  const phi = i * Math.PI * (3 - Math.sqrt(5));
  return [s * Math.cos(phi), s * Math.sin(phi), z];
}

function residualOf(lighting: Lighting, lamps: readonly Lamp[], color: readonly number[], kept: readonly Rgb[],
                    main: Main | null): number {
  const { band, radiance } = lighting.descriptor!;
  let error = 0;
  let whole = 0;
  for (let i = 0; i < residualNormals; ++i) {
    const n = fibonacci(i);
    const basis = harmonicsBasis(Math.max(band, 2), n);
    const ours: Rgb = [0, 0, 0];
    radiance.forEach((c, k) => add(ours, c, cosineLobe[Math.floor(Math.sqrt(k))] * basis[k]));
    const truth = mapped(color, ours);
    for (const lamp of lamps) add(truth, lamp.irradiance, capIrradiance(dot(lamp.towards, n), lamp.radius));
    const target: Rgb = [0, 0, 0];
    kept.forEach((c, k) => add(target, c, cosineLobe[bandOf(k)] * basis[k]));
    if (main) add(target, main.irradiance, Math.max(0, dot(main.lamp.towards, n)));
    for (let k = 0; k < 3; ++k) {
      error += (target[k] - truth[k]) ** 2;
      whole += truth[k] ** 2;
    }
  }
  // In the dark nothing is lost.
  return whole > 0 ? Math.sqrt(error / whole) : 0;
}
