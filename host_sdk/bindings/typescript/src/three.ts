// Lighting for three.js: a LightProbe and a DirectionalLight, as to_three() of conventions.hpp.
//
//   const { value, residual } = toThree(light);
//   lightProbe.sh.fromArray(value.sh);
//   lightProbe.intensity = value.lightProbeIntensity;
//   sun.position.fromArray(value.position);               // its target at the origin
//   sun.color.setRGB(...value.color);                     // linear
//   sun.intensity = value.intensity;
import { Lighting, Validity } from "./lighting.js";
import { bandOf, capIrradiance, capZonal, cosineLobe, harmonicsBasis } from "./lobes.js";
import { Rgb, Vec3, dot, luminance, normalized } from "./vector.js";

export interface ThreeOptions {
  /** Factor that three.js applies to direct light: "physical" from r155 on, "legacy" if useLegacyLights is true. */
  lights?: "physical" | "legacy";
  /** How the strongest light is represented: as a DirectionalLight, or only in the LightProbe. */
  mainLight?: "apart" | "in_harmonics";
  /** Matrix, stored by rows, applied to every colour, for exposure and white point. Default: identity (cd/m², lux). */
  color?: readonly number[];
  residual?: "measured" | "left_out";
}

/** three.js has Lightwell's axes. Without an estimate, the intensities are 0. */
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
  /** Validity of the Lighting; "invalid_query" for an invalid matrix. */
  validity: Validity;
  /** Irradiance error due to what three.js cannot represent (bands above 2, size of the main light): RMS over 512
   *  normals relative to the RMS irradiance. null if it was not computed. */
  residual: number | null;
}

const residualNormals = 512;
const largest = 3.4028234663852886e38 / 1e4;

interface MappedLight {
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

/** A sphere lit by three.js with these values has the irradiance of Lighting.irradiance, except for the residual. A
 *  separate main light is not contained in the harmonics; for a wide one they hold the difference between its cap and a
 *  directional light. */
export function toThree(lighting: Lighting, options: ThreeOptions = {}): ConvertedToThree {
  const { descriptor } = lighting;
  if (descriptor === null || (lighting.validity !== "valid" && lighting.validity !== "stale"))
    return none(lighting.validity);
  const color = (options.color ?? [1, 0, 0, 0, 1, 0, 0, 0, 1]).map(Math.fround);
  if (color.length !== 9 || !color.every(Number.isFinite)) return none("invalid_query");
  const lights = descriptor.lights.map((light): MappedLight => ({
    towards: normalized(light.direction)!,
    irradiance: mapped(color, light.irradiance),
    radius: light.angularRadius,
  }));
  const kept = Array.from({ length: 9 }, (_, i): Rgb =>
    i < descriptor.radiance.length ? mapped(color, descriptor.radiance[i]) : [0, 0, 0]);
  const main = options.mainLight === "in_harmonics" ? null : mainOf(lights);
  for (const light of lights) {
    const basis = harmonicsBasis(2, light.towards);
    kept.forEach((sum, i) => add(sum, light.irradiance, basis[i] * capZonal(bandOf(i), light.radius)));
    // three.js adds the main light as a point light, so the bands 0 to 2 of that are subtracted.
    if (light === main?.light) kept.forEach((sum, i) => add(sum, main.irradiance, -basis[i]));
  }
  if (![...kept, ...(main ? [main.irradiance] : [])].every((c) => c.every((v) => Math.abs(v) <= largest)))
    return none("invalid_query");
  const out = none(lighting.validity);
  out.value.sh = kept.flat();
  out.value.lightProbeIntensity = 1;
  if (main) {
    const most = Math.max(...main.irradiance);
    out.value.position = main.light.towards;
    out.value.color = main.irradiance.map((v) => v / most) as Rgb;
    out.value.intensity = options.lights === "legacy" ? most / Math.PI : most;
  }
  if (options.residual !== "left_out") out.residual = residualOf(lighting, lights, color, kept, main);
  return out;
}

interface Main {
  light: MappedLight;
  /** No channel is negative. */
  irradiance: Rgb;
}

function mainOf(lights: readonly MappedLight[]): Main | null {
  if (lights.length === 0) return null;
  const light = lights.reduce((a, b) => (luminance(b.irradiance) > luminance(a.irradiance) ? b : a));
  const irradiance = light.irradiance.map((v) => Math.max(0, v)) as Rgb;
  return Math.max(...irradiance) > 0 ? { light, irradiance } : null;
}

/** Direction i of the spherical Fibonacci lattice: rings of equal area, each rotated by the golden angle. */
function fibonacci(i: number): Vec3 {
  const z = 1 - (2 * i + 1) / residualNormals;
  const s = Math.sqrt((1 - z) * (1 + z));
  const phi = i * Math.PI * (3 - Math.sqrt(5));
  return [s * Math.cos(phi), s * Math.sin(phi), z];
}

function residualOf(lighting: Lighting, lights: readonly MappedLight[], color: readonly number[], kept: readonly Rgb[],
                    main: Main | null): number {
  const { band, radiance } = lighting.descriptor!;
  let error = 0;
  let whole = 0;
  for (let i = 0; i < residualNormals; ++i) {
    const n = fibonacci(i);
    const basis = harmonicsBasis(Math.max(band, 2), n);
    const ours: Rgb = [0, 0, 0];
    radiance.forEach((c, k) => add(ours, c, cosineLobe[bandOf(k)] * basis[k]));
    const truth = mapped(color, ours);
    for (const light of lights) add(truth, light.irradiance, capIrradiance(dot(light.towards, n), light.radius));
    const target: Rgb = [0, 0, 0];
    kept.forEach((c, k) => add(target, c, cosineLobe[bandOf(k)] * basis[k]));
    if (main) add(target, main.irradiance, Math.max(0, dot(main.light.towards, n)));
    for (let k = 0; k < 3; ++k) {
      error += (target[k] - truth[k]) ** 2;
      whole += truth[k] ** 2;
    }
  }
  // Without light there is no error.
  return whole > 0 ? Math.sqrt(error / whole) : 0;
}
