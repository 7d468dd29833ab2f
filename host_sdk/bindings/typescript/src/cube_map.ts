// The light as a cube map for OpenGL, Vulkan and WebGPU: the texels of C++'s cube_map() (cube_map.hpp).
import type { Light } from "./descriptor.js";
import { EnvironmentMap, cornersAround, levelRadiance, mirrorMap, octahedral } from "./environment.js";
import type { Answer, Lighting } from "./lighting.js";
import { Vec3, dot, inverse, normalized, rotate } from "./vector.js";

export const maxCubeEdge = 64;

/** Of a texel: r, g, b, 1 as half floats (WebGPU "rgba16float") or floats, or one number ("rgb9e5ufloat"). */
export type CubeFormat = "rgba16f" | "rgba32f" | "rgb9e5";

export interface CubeMapOptions {
  /** Texels along an edge of a face, 1 to 64. Default: 64. */
  edge?: number;
  /** Default: "rgba16f". */
  format?: CubeFormat;
  /** "included": the discrete lights are caps of uniform radiance. "excluded": for a renderer that shades them itself.
   *  Default: "included". */
  lights?: "included" | "excluded";
  /** Texel value = scale * radiance, for lights beyond the largest value of the format. Above 0. Default: 1. */
  scale?: number;
}

export interface CubeMap {
  /** Faces +X, -X, +Y, -Y, +Z, -Z, rows from t = 0, no padding. */
  texels: Uint16Array | Float32Array | Uint32Array;
  /** Texels with a channel above the largest value of the format, which they have instead. */
  clamped: number;
  /** Validity, age, bound and flags; its value is the radiance from +Y. */
  about: Answer;
}

const f = Math.fround;
const faces = 6;
/** Samples along the edge of a face; along that of a texel that the border of a light crosses. As in C++. */
const mapSamples = 2 * maxCubeEdge;
const harmonicsSamples = maxCubeEdge;
const lightSamples = 16;
const largest = { rgba16f: 65504, rgba32f: 3.4028234663852886e38, rgb9e5: 65408 };

interface FaceAxes {
  forward: Vec3;
  right: Vec3;
  down: Vec3;
}
const faceAxes: readonly FaceAxes[] = [
  { forward: [1, 0, 0], right: [0, 0, -1], down: [0, -1, 0] },
  { forward: [-1, 0, 0], right: [0, 0, 1], down: [0, -1, 0] },
  { forward: [0, 1, 0], right: [1, 0, 0], down: [0, 0, 1] },
  { forward: [0, -1, 0], right: [1, 0, 0], down: [0, 0, -1] },
  { forward: [0, 0, 1], right: [1, 0, 0], down: [0, -1, 0] },
  { forward: [0, 0, -1], right: [-1, 0, 0], down: [0, -1, 0] },
];

function onFace({ forward, right, down }: FaceAxes, a: number, b: number): Vec3 {
  return [0, 1, 2].map((k) => forward[k] + right[k] * a + down[k] * b) as Vec3;
}

/** Unit vector of a place on a face, u to the right and v down in [0, 1]; row 0 is at v = 0. */
export function cubeDirection(face: number, u: number, v: number): Vec3 {
  return normalized(onFace(faceAxes[Math.min(Math.max(face, 0), faces - 1)], 2 * u - 1, 2 * v - 1))!;
}

/** Solid angle of the part of a face from its centre to the place a, b on it, each -1 to 1. */
const cornerSolidAngle = (a: number, b: number) => Math.atan2(a * b, Math.sqrt(1 + a * a + b * b));

/** Texel `index` of the whole map. */
class Texel {
  readonly face: number;
  readonly column: number;
  readonly row: number;
  readonly center: Vec3;

  constructor(readonly index: number, readonly edge: number) {
    this.face = Math.floor(index / (edge * edge));
    this.row = Math.floor(index / edge) % edge;
    this.column = index % edge;
    this.center = cubeDirection(this.face, (this.column + 0.5) / edge, (this.row + 0.5) / edge);
  }

  get solidAngle(): number {
    const border = (k: number) => (2 * k) / this.edge - 1;
    const [left, right] = [border(this.column), border(this.column + 1)];
    const [top, bottom] = [border(this.row), border(this.row + 1)];
    return cornerSolidAngle(right, bottom) - cornerSolidAngle(left, bottom) - cornerSolidAngle(right, top) +
      cornerSolidAngle(left, top);
  }

}

/** Places in a texel: x, y, z of the direction and the solid angle of each. In floats as in C++, so that the border of
 *  a light runs between the same samples. */
class Samples {
  readonly values: Float32Array;

  constructor(readonly count: number) {
    this.values = new Float32Array(4 * count * count);
  }

  fill(texel: Texel): void {
    const { count, values } = this;
    const { forward, right, down } = faceAxes[texel.face];
    const step = f(2 / (texel.edge * count));
    let at = 0;
    for (let j = 0; j < count; ++j) {
      const b = f(f(f(texel.row * count + j + 0.5) * step) - 1);
      const x = f(forward[0] + f(down[0] * b));
      const y = f(forward[1] + f(down[1] * b));
      const z = f(forward[2] + f(down[2] * b));
      for (let i = 0; i < count; ++i, at += 4) {
        const a = f(f(f(texel.column * count + i + 0.5) * step) - 1);
        const reciprocal = f(1 / f(Math.sqrt(f(f(1 + f(a * a)) + f(b * b)))));
        values[at] = f(x + f(right[0] * a)) * reciprocal;
        values[at + 1] = f(y + f(right[1] * a)) * reciprocal;
        values[at + 2] = f(z + f(right[2] * a)) * reciprocal;
        values[at + 3] = f(f(f(step * step) * reciprocal) * reciprocal) * reciprocal;
      }
    }
  }
}

/** Number of the texel that contains a direction. */
function texelWith(d: Vec3, edge: number): number {
  let axis = 0;
  for (let k = 1; k < 3; ++k) if (Math.abs(d[k]) > Math.abs(d[axis])) axis = k;
  const face = 2 * axis + (d[axis] < 0 ? 1 : 0);
  const { forward, right, down } = faceAxes[face];
  const distance = dot(forward, d);
  const index = (along: Vec3) =>
    Math.min(Math.max(Math.trunc(((dot(along, d) / distance + 1) / 2) * edge), 0), edge - 1);
  return (face * edge + index(down)) * edge + index(right);
}

/** A light, spread over the texels that its cap covers, with all of its energy: first cover() of every texel, then
 *  finish(), then addTo(). */
class SpreadLight {
  private readonly axis: Vec3;
  private readonly cosRho: number;
  private readonly cosOutside: number;
  private readonly cosInside: number;
  private readonly covered: Float64Array;
  private sum = 0;
  /** Radiance times solid angle of the light, per covered solid angle. */
  private energy: Vec3;

  constructor(light: Light, edge: number) {
    const rho = light.angularRadius;
    const radius = Math.SQRT2 / edge;
    this.axis = normalized(light.direction)!;
    this.cosRho = Math.cos(rho);
    this.cosOutside = rho + radius < Math.PI ? Math.cos(rho + radius) : -1;
    this.cosInside = rho > radius ? Math.cos(rho - radius) : 2;
    this.covered = new Float64Array(faces * edge * edge);
    // Radiance times solid angle of a cap whose vector irradiance is pi sin²(rho) times its radiance.
    this.energy = light.irradiance.map((v) => (v * 2) / (1 + this.cosRho)) as Vec3;
  }

  /** "border": the texel is partly covered, and cover() needs its samples. */
  place(texel: Texel): "outside" | "inside" | "border" {
    const c = dot(this.axis, texel.center);
    return c < this.cosOutside ? "outside" : c > this.cosInside ? "inside" : "border";
  }

  cover(texel: Texel, samples: Samples | null): void {
    let solidAngle = 0;
    if (samples === null) solidAngle = texel.solidAngle;
    else {
      const { values } = samples;
      const [x, y, z] = this.axis;
      for (let i = 0; i < values.length; i += 4)
        if (x * values[i] + y * values[i + 1] + z * values[i + 2] >= this.cosRho) solidAngle += values[i + 3];
    }
    this.covered[texel.index] = solidAngle;
    this.sum += solidAngle;
  }

  finish(edge: number): void {
    // Between two samples: all in the texel around it.
    if (this.sum === 0) this.covered[texelWith(this.axis, edge)] = this.sum = 1;
    this.energy = this.energy.map((v) => v / this.sum) as Vec3;
  }

  /** Adds its mean radiance over the texel to `mean`. */
  addTo(mean: Vec3, texel: Texel): void {
    const covered = this.covered[texel.index];
    if (covered === 0) return;
    const share = covered / texel.solidAngle;
    for (let k = 0; k < 3; ++k) mean[k] += this.energy[k] * share;
  }
}

function spreadLights(lights: readonly Light[], texels: readonly Texel[]): SpreadLight[] {
  const { edge } = texels[0];
  const spread = lights.map((light) => new SpreadLight(light, edge));
  const samples = new Samples(lightSamples);
  for (const texel of texels) {
    let filled = false;
    for (const light of spread) {
      const place = light.place(texel);
      if (place === "outside") continue;
      if (place === "border" && !filled) {
        samples.fill(texel);
        filled = true;
      }
      light.cover(texel, place === "border" ? samples : null);
    }
  }
  for (const light of spread) light.finish(edge);
  return spread;
}

/** radiance(d, 0) of a map, as environmentRadiance(), from texels that are decoded once. */
function mapSampler(map: EnvironmentMap): (d: Vec3) => Vec3 {
  const { edge } = map.levels[0];
  const texels = levelRadiance(map, 0);
  const toMap = map.rotation ? inverse(map.rotation) : null;
  const out: Vec3 = [0, 0, 0];
  return (d) => {
    const uv = octahedral(normalized((toMap ? rotate(toMap, d) : d).map(f) as Vec3, f)!);
    const { texels: [a, b, c, e], fx, fy } = cornersAround(edge, uv);
    for (let k = 0; k < 3; ++k)
      out[k] = (texels[3 * a + k] * (1 - fx) + texels[3 * b + k] * fx) * (1 - fy) +
        (texels[3 * c + k] * (1 - fx) + texels[3 * e + k] * fx) * fy;
    return out;
  };
}

const bits = new DataView(new ArrayBuffer(4));

/** The bits of a half float, rounded to the nearest, ties to even. v: 0 to 65504. */
function halfBits(v: number): number {
  if (f(v) < 2 ** -14) {
    const units = f(v) * 2 ** 24;
    const below = Math.floor(units);
    const rest = units - below;
    return rest > 0.5 || (rest === 0.5 && below % 2 === 1) ? below + 1 : below;
  }
  bits.setFloat32(0, v);
  const value = bits.getUint32(0) - (112 << 23);
  return (value + 0xfff + ((value >>> 13) & 1)) >>> 13;
}

/** RGB9E5 of values from 0 to 65408. */
function rgb9e5([r, g, b]: Vec3): number {
  const most = Math.max(f(r), f(g), f(b));
  if (!(most > 0)) return 0;
  bits.setFloat32(0, most);
  // Subnormal values have an exponent of -127, which the limit replaces.
  let exponent = Math.max((bits.getUint32(0) >>> 23) - 127, -16) + 16;
  const mantissa = (v: number) => Math.floor(f(f(f(v) * 2 ** (24 - exponent)) + 0.5));
  // Where the largest mantissa would be rounded to 2^9.
  if (mantissa(most) >= 512) ++exponent;
  return ((exponent << 27) | (mantissa(b) << 18) | (mantissa(g) << 9) | mantissa(r)) >>> 0;
}

/** Six faces of radiance(d, 0) with the lights, each texel the mean over its solid angle. Axes are those of `light`.
 *  It takes many frames at edge 64; no DOM, so that a worker can call it. Throws RangeError for an option that is
 *  not allowed. Without light all texels are 0. */
export function cubeMap(light: Lighting, options: CubeMapOptions = {}): CubeMap {
  const { edge = maxCubeEdge, format = "rgba16f", lights = "included", scale = 1 } = options;
  if (!Number.isInteger(edge) || edge < 1 || edge > maxCubeEdge)
    throw new RangeError(`edge is ${edge}; it is 1 to ${maxCubeEdge}`);
  if (!(format in largest)) throw new RangeError(`format is ${format}; it is rgba16f, rgba32f or rgb9e5`);
  if (lights !== "included" && lights !== "excluded")
    throw new RangeError(`lights is ${lights}; it is included or excluded`);
  if (!(scale > 0) || !Number.isFinite(scale)) throw new RangeError(`scale is ${scale}; it is finite and above 0`);
  const count = faces * edge * edge;
  const all = Array.from({ length: count }, (_, index) => new Texel(index, edge));
  const { environment } = light;
  const mirror = environment && lights === "included" ? mirrorMap(environment, light.lights) : null;
  const caps = mirror ? light.lights.filter((one) => !mirror.lightTracks.includes(one.track)) : light.lights;
  const spread = lights === "included" ? spreadLights(caps, all) : [];
  const sharp = environment ? mapSampler(mirror ?? environment) : (d: Vec3) => light.radiance(d, 0).value;
  const samples = new Samples(Math.ceil((environment ? mapSamples : harmonicsSamples) / edge));
  const texels = format === "rgba16f" ? new Uint16Array(4 * count)
    : format === "rgba32f" ? new Float32Array(4 * count) : new Uint32Array(count);
  let clamped = 0;
  for (const texel of all) {
    const mean: Vec3 = [0, 0, 0];
    let weights = 0;
    samples.fill(texel);
    const { values } = samples;
    for (let i = 0; i < values.length; i += 4) {
      const value = sharp([values[i], values[i + 1], values[i + 2]]);
      for (let k = 0; k < 3; ++k) mean[k] += value[k] * values[i + 3];
      weights += values[i + 3];
    }
    for (let k = 0; k < 3; ++k) mean[k] /= weights;
    for (const one of spread) one.addTo(mean, texel);
    let above = false;
    for (let k = 0; k < 3; ++k) {
      const v = mean[k] * scale;
      above = above || v > largest[format];
      mean[k] = v > 0 ? Math.min(v, largest[format]) : 0;
    }
    if (above) ++clamped;
    if (format === "rgb9e5") texels[texel.index] = rgb9e5(mean);
    else if (format === "rgba32f") texels.set([...mean, 1], 4 * texel.index);
    else texels.set([...mean.map(halfBits), 0x3c00], 4 * texel.index);
  }
  return { texels, clamped, about: light.radiance([0, 1, 0], 0) };
}
