// Prefiltered environment map for reflections: octahedral levels, each prefiltered with one GGX lobe, without the
// lights.
import type { Descriptor } from "./descriptor.js";
import { Quat, Rgb, Vec3, composed, inverse, normalized, rotate } from "./vector.js";
import {
  WireReader, byteString, crc32c, fixed32, float, invalid, message, repeatedUint32, sint32, uint32,
} from "./wire.js";

export const maxEnvironmentTexels = 8192;
export const maxEnvironmentLevels = 8;
export const maxEnvironmentEdge = 64;

/** edge x edge texels: +Y at the centre, column i increases with x, row j with z, centres at (i + 0.5) / edge. */
export interface EnvironmentLevel {
  readonly edge: number;
  /** Perceptual roughness. */
  readonly roughness: number;
}

export interface EnvironmentMap {
  /** Key of this whole map, or of the whole map to which these changes apply. */
  readonly key: number;
  /** Whole map: its levels in order of increasing roughness. Empty: changes. */
  readonly levels: readonly EnvironmentLevel[];
  /** Whole map: radiance = texel times 2^exponent. */
  readonly exponent: number;
  /** Whole map: longest interval between whole maps, ms. */
  readonly keyIntervalMs: number;
  /** RGB9E5, red in the lowest bits: level by level, rows from the top. Changes: the changed texels. */
  readonly texels: Uint32Array;
  /** p_lighting = rotation p_map. Only from EnvironmentKeeper.mapFor(), where the probe has turned since the map
   *  against a plane that it moves around; `texels` is then that of the map without. */
  readonly rotation?: Quat;
  /** Changes: run lengths, alternately of unchanged texels and of changed texels (those in `texels`). */
  readonly runs: readonly number[];
  /** Tracks of the lights that texels show better than caps, ascending; empty where there are none. The other two say
   *  what the first level is with these lights in it: run lengths, alternately of texels as in `texels` and of those in
   *  `lightTexels`. */
  readonly lightTracks: readonly number[];
  readonly lightRuns: readonly number[];
  readonly lightTexels: Uint32Array;
}

export function isWhole(map: EnvironmentMap): boolean {
  return map.levels.length > 0;
}

function texelCount(levels: readonly EnvironmentLevel[]): number {
  return levels.reduce((sum, level) => sum + level.edge * level.edge, 0);
}

function keyOf(map: EnvironmentMap): number {
  const bytes = new DataView(new ArrayBuffer(4 + 8 * map.levels.length + 4 * map.texels.length));
  bytes.setInt32(0, map.exponent, true);
  let at = 4;
  for (const level of map.levels) {
    bytes.setUint32(at, level.edge, true);
    bytes.setFloat32(at + 4, level.roughness, true);
    at += 8;
  }
  map.texels.forEach((texel, i) => bytes.setUint32(at + 4 * i, texel, true));
  return crc32c(new Uint8Array(bytes.buffer)) || 1;
}

/** Parses the fields; `get` validates them. */
export class EnvironmentMessage {
  private readonly map = {
    key: 0, levels: [] as { edge: number; roughness: number }[], exponent: 0, keyIntervalMs: 0, runs: [] as number[],
    lightTracks: [] as number[], lightRuns: [] as number[],
  };
  private encoding = 0;
  private texels = new Uint8Array(0);
  private lightTexels = new Uint8Array(0);

  read(wire: WireReader): void {
    wire.fields({
      1: fixed32((v) => (this.map.key = v)),
      2: uint32((v) => (this.encoding = v)),
      3: message((part) => {
        const level = { edge: 0, roughness: 0 };
        part.fields({ 1: uint32((v) => (level.edge = v)), 2: float((v) => (level.roughness = v)) });
        this.map.levels.push(level);
      }),
      4: sint32((v) => (this.map.exponent = v)),
      5: uint32((v) => (this.map.keyIntervalMs = v)),
      6: byteString((v) => (this.texels = v)),
      7: repeatedUint32((v) => this.map.runs.push(v)),
      8: repeatedUint32((v) => this.map.lightTracks.push(v)),
      9: repeatedUint32((v) => this.map.lightRuns.push(v)),
      10: byteString((v) => (this.lightTexels = v)),
    });
  }

  get(): EnvironmentMap {
    if (this.encoding !== 1) throw invalid("environment.encoding is not known");
    const texels = unpackedTexels(this.texels, "texels");
    const map: EnvironmentMap = { ...this.map, texels, lightTexels: unpackedTexels(this.lightTexels, "light_texels") };
    if (map.key === 0) throw invalid("environment.key is 0");
    if (isWhole(map)) checkWhole(map);
    else checkChanges(map);
    return map;
  }
}

function unpackedTexels(bytes: Uint8Array, name: string): Uint32Array {
  if (bytes.length % 4 !== 0) throw invalid(`environment.${name}: the length is not a multiple of 4 bytes`);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  return Uint32Array.from({ length: bytes.length / 4 }, (_, i) => view.getUint32(4 * i, true));
}

/** `name`: of the field with the runs. `limit`: most texels over which they may reach. */
function checkRuns(name: string, runs: readonly number[], limit: number): void {
  if (runs.length % 2 !== 0) throw invalid(`environment.${name}: the number is odd; they are pairs`);
  if (runs.some((run, k) => run === 0 && k > 0)) throw invalid(`environment.${name}: one is empty`);
  if (sum(runs) > limit) throw invalid(`environment.${name}: they exceed the size of any map`);
}

function sum(runs: readonly number[]): number {
  return runs.reduce((total, run) => total + run, 0);
}

/** Texels that the runs change. */
function changedBy(runs: readonly number[]): number {
  return sum(runs.filter((_, k) => k % 2 === 1));
}

function checkLights({ lightTracks, lightRuns, lightTexels }: EnvironmentMap, limit: number): void {
  if (lightTracks.length > 64) throw invalid("environment.light_tracks: there are more than 64");
  if (lightTracks[0] === 0) throw invalid("environment.light_tracks: 0 is not a track");
  if (lightTracks.some((track, k) => k > 0 && track <= lightTracks[k - 1]))
    throw invalid("environment.light_tracks: they must ascend");
  checkRuns("light_runs", lightRuns, limit);
  if (lightTexels.length !== changedBy(lightRuns))
    throw invalid("environment.light_texels: the length does not match light_runs");
  if ((lightTracks.length === 0) !== (lightTexels.length === 0))
    throw invalid("environment.light_tracks and light_texels: one is empty");
}

function checkWhole(map: EnvironmentMap): void {
  if (map.levels.length > maxEnvironmentLevels) throw invalid("environment.levels: there are more than 8");
  map.levels.forEach((level, k) => {
    if (![8, 16, 32, 64].includes(level.edge)) throw invalid("environment.levels: an edge must be 8, 16, 32 or 64");
    if (!(level.roughness >= 0 && level.roughness <= 1))
      throw invalid("environment.levels: a roughness must be 0 to 1");
    if (k === 0) return;
    const before = map.levels[k - 1];
    if (level.edge > before.edge) throw invalid("environment.levels: an edge is larger than the one before");
    if (!(level.roughness > before.roughness)) throw invalid("environment.levels: roughness must increase");
  });
  const count = texelCount(map.levels);
  if (count > maxEnvironmentTexels) throw invalid("environment.levels have more than 8192 texels");
  if (map.texels.length !== count) throw invalid("environment.texels: the length does not match the levels");
  if (map.exponent < -150 || map.exponent > 100) throw invalid("environment.exponent is out of range");
  if (map.runs.length > 0) throw invalid("environment.runs: not allowed in a whole map");
  checkLights(map, texelCount(map.levels.slice(0, 1)));
  if (map.key !== keyOf(map)) throw invalid("environment.key does not match the content of the map");
}

function checkChanges(map: EnvironmentMap): void {
  if (map.exponent !== 0) throw invalid("environment.exponent: not allowed in changes");
  if (map.keyIntervalMs !== 0) throw invalid("environment.key_interval_ms: not allowed in changes");
  checkRuns("runs", map.runs, maxEnvironmentTexels);
  if (map.texels.length !== changedBy(map.runs))
    throw invalid("environment.texels: the length does not match the runs");
  checkLights(map, maxEnvironmentEdge ** 2);
}

/** Writes `texels` to those of `out` that the runs change. */
function replaceRuns(runs: readonly number[], texels: Uint32Array, out: Uint32Array): void {
  let at = 0;
  let from = 0;
  runs.forEach((run, k) => {
    if (k % 2 === 1) {
      out.set(texels.subarray(from, from + run), at);
      from += run;
    }
    at += run;
  });
}

function changedMap(whole: EnvironmentMap, changes: EnvironmentMap): EnvironmentMap | null {
  if (changes.key !== whole.key || sum(changes.runs) > whole.texels.length ||
      sum(changes.lightRuns) > texelCount(whole.levels.slice(0, 1))) return null;
  const texels = whole.texels.slice();
  replaceRuns(changes.runs, changes.texels, texels);
  const { lightTracks, lightRuns, lightTexels } = changes;
  return { ...whole, texels, lightTracks, lightRuns, lightTexels };
}

const mirrors = new WeakMap<EnvironmentMap, EnvironmentMap>();

/** The first level of a whole map with the lights that its texels show better than caps do, a window for example, as a
 *  map of one level. null where there are none, or where one of them is no longer in `lights`. A renderer that draws a
 *  mirror samples it instead of the map, and draws as caps the lights whose track is not in `map.lightTracks`. */
export function mirrorMap(map: EnvironmentMap, lights: readonly { readonly track: number }[]): EnvironmentMap | null {
  if (map.lightTracks.length === 0) return null;
  if (!map.lightTracks.every((track) => lights.some((light) => light.track === track))) return null;
  let mirror = mirrors.get(map);
  if (!mirror) {
    const levels = map.levels.slice(0, 1);
    const texels = map.texels.slice(0, texelCount(levels));
    replaceRuns(map.lightRuns, map.lightTexels, texels);
    mirrors.set(map, (mirror = { ...map, levels, texels }));
  }
  return mirror;
}

/** Share of the first level in environmentRadiance(): 1 up to its roughness, 0 from that of the second. */
export function firstLevelShare({ levels }: EnvironmentMap, roughness: number): number {
  const r = f(roughness);
  if (levels.length < 2 || r <= levels[0].roughness) return 1;
  return Math.max(0, 1 - (r - levels[0].roughness) / (levels[1].roughness - levels[0].roughness));
}

/** Assembles the current map of one probe from descriptors with a whole map, with changes, or without a map. */
export class EnvironmentKeeper {
  private whole: EnvironmentMap | null = null;
  private newest: { map: EnvironmentMap; from: Descriptor } | null = null;

  /** Processes a received descriptor. False if it has changes to a whole map that was not received: the last map is
   *  kept. */
  take(descriptor: Descriptor): boolean {
    const came = descriptor.environment;
    if (came === null) return true;
    const map = isWhole(came) ? came : this.whole === null ? null : changedMap(this.whole, came);
    if (map === null) return false;
    if (isWhole(came)) this.whole = came;
    this.newest = { map, from: descriptor };
    return true;
  }

  /** The newest map if it applies to the descriptor: same probe, calibration and units, not newer, and not older than
   *  three of its key intervals. In the descriptor's axes, by `rotation`. */
  mapFor(descriptor: Descriptor): EnvironmentMap | null {
    if (this.newest === null) return null;
    const { map, from } = this.newest;
    if (from.units !== descriptor.units || from.probeId !== descriptor.probeId ||
        from.calibrationId !== descriptor.calibrationId) return null;
    const older = descriptor.midExposureNs - from.midExposureNs;
    if (older < 0n || older > 3_000_000n * BigInt(map.keyIntervalMs)) return null;
    // A map comes from light in a room where the origin does not turn: it is the probe itself, or such a plane.
    const [now, then] = [descriptor.origin.rotation, from.origin.rotation];
    return now.every((v, k) => v === then[k]) ? map : { ...map, rotation: composed(now, inverse(then)) };
  }
}

const f = Math.fround;

/** The radiance of a texel; its luminance is in cd/m² if units are absolute. */
export function texelRadiance(texel: number, exponent: number): Rgb {
  const unit = 2 ** ((texel >>> 27) - 24 + exponent);
  return [f((texel & 511) * unit), f(((texel >>> 9) & 511) * unit), f(((texel >>> 18) & 511) * unit)];
}

/** A level of a whole map: r, g, b of each texel, rows from the top. */
export function levelRadiance(map: EnvironmentMap, level: number): Float32Array {
  const first = texelCount(map.levels.slice(0, level));
  const { edge } = map.levels[level];
  const out = new Float32Array(3 * edge * edge);
  for (let i = 0; i < edge * edge; ++i) out.set(texelRadiance(map.texels[first + i], map.exponent), 3 * i);
  return out;
}

/** Octahedral coordinates, 0 to 1, with the map's centre at +Y (Cigolle et al. 2014, listing 1). Rounded to float as in
 *  C++, because between texels that differ much the interpolation is sensitive to the coordinates. */
export function octahedral(d: Vec3): [number, number] {
  const sum = f(f(Math.abs(d[0]) + Math.abs(d[1])) + Math.abs(d[2]));
  let a = f(d[0] / sum);
  let b = f(d[2] / sum);
  if (d[1] < 0) {
    const sign = (v: number) => (v < 0 || Object.is(v, -0) ? -1 : 1);
    const folded = f(f(1 - Math.abs(b)) * sign(a));
    b = f(f(1 - Math.abs(a)) * sign(b));
    a = folded;
  }
  return [f(0.5 * f(a + 1)), f(0.5 * f(b + 1))];
}

/** Beyond an edge of the square the sphere continues at the same edge with the order of texels reversed. */
function texelAt(edge: number, i: number, j: number): number {
  if (i < 0 || i >= edge) {
    i = i < 0 ? -1 - i : 2 * edge - 1 - i;
    j = edge - 1 - j;
  }
  if (j < 0 || j >= edge) {
    j = j < 0 ? -1 - j : 2 * edge - 1 - j;
    i = edge - 1 - i;
  }
  return j * edge + i;
}

/** Four texels (their numbers in a level) around a place on the square, left before right and upper before lower, and
 *  how far the place is from the first to the second and from the first to the third, 0 to 1. */
export interface TexelCorners {
  texels: readonly [number, number, number, number];
  fx: number;
  fy: number;
}

export function cornersAround(edge: number, uv: readonly [number, number]): TexelCorners {
  const x = f(f(uv[0] * edge) - 0.5);
  const y = f(f(uv[1] * edge) - 0.5);
  const i = Math.floor(x);
  const j = Math.floor(y);
  const fx = x - i;
  const fy = y - j;
  return {
    texels: [texelAt(edge, i, j), texelAt(edge, i + 1, j), texelAt(edge, i, j + 1), texelAt(edge, i + 1, j + 1)],
    fx,
    fy,
  };
}

function bilinear(map: EnvironmentMap, level: number, uv: [number, number]): Rgb {
  const first = texelCount(map.levels.slice(0, level));
  const { texels, fx, fy } = cornersAround(map.levels[level].edge, uv);
  const corners = texels.map((k) => texelRadiance(map.texels[first + k], map.exponent));
  const mixed = (k: number) =>
    (corners[0][k] * (1 - fx) + corners[1][k] * fx) * (1 - fy) + (corners[2][k] * (1 - fx) + corners[3][k] * fx) * fy;
  return [mixed(0), mixed(1), mixed(2)];
}

/** radiance(d, r) without the lights, in the frame of the lighting. Zero for a direction that is zero or not finite. */
export function environmentRadiance(map: EnvironmentMap, direction: Vec3, roughness: number): Rgb {
  const inMap = map.rotation ? rotate(inverse(map.rotation), direction) : direction;
  const d = normalized(inMap.map(f) as Vec3, f);
  if (d === null || !isWhole(map)) return [0, 0, 0];
  const uv = octahedral(d);
  const r = f(roughness);
  const { levels } = map;
  let upper = 0;
  while (upper + 1 < levels.length && !(r <= levels[upper].roughness)) ++upper;
  if (upper === 0 || !(r < levels[upper].roughness)) return bilinear(map, upper, uv);
  const low = levels[upper - 1].roughness;
  const share = (r - low) / (levels[upper].roughness - low);
  const a = bilinear(map, upper - 1, uv);
  const b = bilinear(map, upper, uv);
  return [0, 1, 2].map((k) => a[k] * (1 - share) + b[k] * share) as Rgb;
}
