// The lighting of one moment: the queries of C++'s Lighting, with the same results.
import { Descriptor, Flag, Light, Units, decodeDescriptor } from "./descriptor.js";
import { EnvironmentKeeper, EnvironmentMap, environmentRadiance } from "./environment.js";
import { GgxLobe, capIrradiance, capRadiance, cosineLobe, evaluateHarmonics } from "./lobes.js";
import { RadianceReconstruction, radianceAt, reconstruct } from "./reconstruction.js";
import { Rgb, Vec3, dot, normalized } from "./vector.js";

export type Validity = "valid" | "stale" | "none" | "invalid_query";

/** A value with its validity, age and error bound. */
export interface Answer {
  /** Linear Rec. 709. Luminance of irradiance in lux, of radiance in cd/m², if units are absolute. */
  value: Rgb;
  validity: Validity;
  /** Time since mid-exposure, as given in LightingOptions. */
  ageMs: number;
  /** Why it is not valid; empty if it is. */
  reason: string;
  /** 0.01 is 1 %; infinite where no bound exists; the flags give the reason. */
  errorBound: number;
  flags: ReadonlySet<Flag>;
  /** False for radiance at roughness 0, which excludes the discrete lights. */
  lightsIncluded: boolean;
  units: Units;
}

export interface LightingOptions {
  /** Time since mid-exposure, ms. Default: 0. */
  ageMs?: number;
  /** Age above which the lighting is stale, ms. Default: 250. */
  maxAgeMs?: number;
  /** The current whole map, from an EnvironmentKeeper. Default: the descriptor's own, if it has a whole one. */
  environment?: EnvironmentMap | null;
}

const noFlags: ReadonlySet<Flag> = new Set();
const mirrorFactors: readonly number[] = [1, 1, 1, 1, 1, 1, 1];
const zero = (): Rgb => [0, 0, 0];

/** The lighting of one moment, immutable. Directions and normals: right-handed, +X right, +Y up, -Z forward; any
 *  length. */
export class Lighting {
  readonly environment: EnvironmentMap | null;
  readonly validity: Validity;
  /** Why this is not valid; empty if it is. */
  readonly reason: string;
  readonly ageMs: number;
  private reconstruction: RadianceReconstruction | null = null;
  private lobe: { roughness: number; lobe: GgxLobe; factors: number[] } | null = null;

  /** null: no descriptor has been received yet. */
  constructor(readonly descriptor: Descriptor | null, options: LightingOptions = {}) {
    const maxAgeMs = options.maxAgeMs ?? 250;
    this.ageMs = Math.max(0, options.ageMs ?? 0);
    if (descriptor === null) {
      this.validity = "none";
      this.reason = "no descriptor has come yet";
      this.environment = null;
      return;
    }
    // The negated comparison makes an age of NaN stale.
    this.validity = this.ageMs <= maxAgeMs ? "valid" : "stale";
    this.reason = this.validity === "valid" ? "" :
      `${Math.round(this.ageMs)} ms from the nearest descriptor, and maxAgeMs is ${maxAgeMs} ms`;
    this.environment = options.environment === undefined ? ownMap(descriptor) : options.environment;
  }

  /** Decodes a LightingDescriptor. Throws DecodeError. */
  static decode(bytes: Uint8Array, options: LightingOptions = {}): Lighting {
    return new Lighting(decodeDescriptor(bytes), options);
  }

  /** Strongest first. */
  get lights(): readonly Light[] {
    return this.descriptor?.lights ?? [];
  }

  /** Irradiance of a flat receiver that faces `normal`. Not divided by pi. Not clamped: can be slightly negative where
   *  the truncated series rings. */
  irradiance(normal: Vec3): Answer {
    const n = normalized(normal);
    if (this.descriptor === null || n === null) return this.answer(zero(), n !== null, true);
    const value = evaluateHarmonics(this.descriptor.radiance, n, cosineLobe);
    for (const light of this.descriptor.lights) {
      const k = capIrradiance(dot(unit(light), n), light.angularRadius);
      for (let c = 0; c < 3; ++c) value[c] += light.irradiance[c] * k;
    }
    return this.answer(value, true, true);
  }

  /** Radiance as reflected by a surface of that perceptual roughness (alpha = roughness²): the GGX-weighted mean with
   *  N = V = R = direction. At roughness 0 (a mirror) the discrete lights are excluded. Never negative: without a map
   *  the harmonics are windowed against ringing, and bands that were not sent are estimated (reconstruction.ts). */
  radiance(direction: Vec3, roughness: number): Answer {
    const mirror = roughness <= 0;
    const d = normalized(direction);
    const good = d !== null && Number.isFinite(roughness);
    if (this.descriptor === null || d === null || !good) return this.answer(zero(), good, !mirror);
    if (mirror) {
      const value = this.environment ? environmentRadiance(this.environment, direction, 0)
                                     : radianceAt(this.reconstructed(this.descriptor), d, 0, mirrorFactors);
      return this.answer(value, true, false);
    }
    const { roughness: r, lobe, factors } = this.lobeOf(Math.min(Math.max(roughness, GgxLobe.minRoughness), 1));
    const value = this.environment ? environmentRadiance(this.environment, direction, r)
                                   : radianceAt(this.reconstructed(this.descriptor), d, r, factors);
    for (const light of this.descriptor.lights) {
      const k = capRadiance(dot(unit(light), d), light.angularRadius, lobe);
      for (let c = 0; c < 3; ++c) value[c] += light.irradiance[c] * k;
    }
    return this.answer(value, true, true);
  }

  /** Spherical harmonics of the irradiance without the lights: descriptor.radiance times A_l. */
  irradianceCoefficients(): Rgb[] {
    return (this.descriptor?.radiance ?? [zero()]).map((c, i) => {
      const k = cosineLobe[Math.floor(Math.sqrt(i))];
      return [c[0] * k, c[1] * k, c[2] * k];
    });
  }

  private answer(value: Rgb, good: boolean, lightsIncluded: boolean): Answer {
    const d = this.descriptor;
    const asked = good || d === null;
    return {
      value,
      validity: asked ? this.validity : "invalid_query",
      ageMs: this.ageMs,
      reason: asked ? this.reason : "the direction or roughness is zero or not finite",
      errorBound: d?.bound.total ?? 0,
      flags: d?.flags ?? noFlags,
      lightsIncluded,
      units: d?.units ?? "relative",
    };
  }

  /** Computed at the first query that needs it, in milliseconds; not needed with a map or for irradiance. */
  private reconstructed(descriptor: Descriptor): RadianceReconstruction {
    return (this.reconstruction ??= reconstruct(descriptor.radiance));
  }

  /** The last lobe is cached, because shading usually evaluates many directions at one roughness. */
  private lobeOf(roughness: number) {
    if (this.lobe?.roughness !== roughness) {
      const lobe = new GgxLobe(Math.fround(roughness));
      this.lobe = { roughness, lobe, factors: lobe.coefficients() };
    }
    return this.lobe!;
  }
}

/** Normalises in double: float directions have unit length to seven digits only, too few near a narrow lobe's axis. */
function unit(light: Light): Vec3 {
  return normalized(light.direction)!;
}

function ownMap(descriptor: Descriptor): EnvironmentMap | null {
  const keeper = new EnvironmentKeeper();
  keeper.take(descriptor);
  return keeper.mapFor(descriptor);
}
