// The lighting of one moment: the queries of C++'s Lighting, with the same results.
import { Descriptor, Flag, Light, Units, decodeDescriptor } from "./descriptor.js";
import {
  EnvironmentKeeper, EnvironmentMap, environmentRadiance, firstLevelShare, mirrorMap,
} from "./environment.js";
import { GgxLobe, bandOf, capIrradiance, capRadiance, cosineLobe, evaluateHarmonics } from "./lobes.js";
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
const mirrorLobe = { roughness: 0, lobe: null, factors: [1, 1, 1, 1, 1, 1, 1] };
const zero = (): Rgb => [0, 0, 0];
/** Of all instances for one descriptor, because a connection makes one for every frame that is drawn. */
const reconstructions = new WeakMap<Descriptor, RadianceReconstruction>();

/** The lighting of one moment, immutable. Directions and normals: right-handed, +X right, +Y up, -Z forward; any
 *  length. */
export class Lighting {
  readonly environment: EnvironmentMap | null;
  readonly validity: Validity;
  /** Why this is not valid; empty if it is. */
  readonly reason: string;
  readonly ageMs: number;
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
    addLights(value, this.descriptor.lights, n, capIrradiance);
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
    const { roughness: r, lobe, factors } =
      mirror ? mirrorLobe : this.lobeOf(Math.min(Math.max(roughness, GgxLobe.minRoughness), 1));
    const value = this.environment ? environmentRadiance(this.environment, direction, r)
                                   : radianceAt(this.reconstructed(this.descriptor), d, r, factors);
    if (lobe) {
      const cap = (cosine: number, radius: number) => capRadiance(cosine, radius, lobe);
      addLights(value, this.descriptor.lights, d, cap);
      if (this.environment) this.showLights(value, this.environment, d, r, cap);
    }
    return this.answer(value, true, !mirror);
  }

  /** As far as the first level of the map has a share in `value`, lights that its texels show (mirrorMap()) become
   *  these texels. */
  private showLights(value: Rgb, map: EnvironmentMap, d: Vec3, r: number,
                     cap: (cosine: number, radius: number) => number): void {
    const share = firstLevelShare(map, r);
    const mirror = share > 0 ? mirrorMap(map, this.lights) : null;
    if (mirror === null) return;
    const caps = zero();
    addLights(caps, this.lights.filter((light) => map.lightTracks.includes(light.track)), d, cap);
    const shown = environmentRadiance(mirror, d, 0);
    const without = environmentRadiance(map, d, 0);
    for (let k = 0; k < 3; ++k) value[k] = Math.max(0, value[k] + share * (shown[k] - without[k] - caps[k]));
  }

  /** Spherical harmonics of the irradiance without the lights: descriptor.radiance times A_l. */
  irradianceCoefficients(): Rgb[] {
    return (this.descriptor?.radiance ?? [zero()]).map((c, i) => {
      const k = cosineLobe[bandOf(i)];
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
    let found = reconstructions.get(descriptor);
    if (!found) reconstructions.set(descriptor, (found = reconstruct(descriptor.radiance)));
    return found;
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

/** Adds to `sum` the irradiance of each light times `weight` of the angle between it and `d`. */
function addLights(sum: Rgb, lights: readonly Light[], d: Vec3, weight: (cosine: number, radius: number) => number) {
  for (const light of lights) {
    // Normalised in double: float directions have unit length to seven digits only, too few near a narrow lobe's axis.
    const k = weight(dot(normalized(light.direction)!, d), light.angularRadius);
    for (let c = 0; c < 3; ++c) sum[c] += light.irradiance[c] * k;
  }
}

function ownMap(descriptor: Descriptor): EnvironmentMap | null {
  const keeper = new EnvironmentKeeper();
  keeper.take(descriptor);
  return keeper.mapFor(descriptor);
}
