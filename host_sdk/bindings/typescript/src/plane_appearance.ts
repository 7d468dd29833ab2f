// A captured plane as an application sees it: its radiance from any viewpoint, L(x, v) = D(x) + S(v).
// host_sdk/include/lightwell/plane_appearance.hpp.
import { Validity } from "./lighting.js";
import { PlaneCoverage, PlaneGuidance, PlaneGuidanceOptions, planeGuidance } from "./plane_guidance.js";
import type { PlaneState } from "./plane_reader.js";
import { PlaneInfo } from "./plane_update.js";
import { Pose, Quat, Rgb, Vec3, rotate } from "./vector.js";

const f = Math.fround;

/** D + S, or one of the two: D alone is what is seen where a virtual object hides the mirror image of the room. */
export type PlaneLayers = "all" | "diffuse" | "specular";

/** Why a radiance may be wrong: no frame saw the plane from there, or one of the four texels; or they were saturated,
 *  and the radiance is a lower bound. */
export type PlaneFlag = "unseen_direction" | "clipped_direction" | "unseen_texel" | "clipped_texel";
/** Bit k of PlaneRendering.flags stands for flag k. */
export const planeFlags: readonly PlaneFlag[] =
  ["unseen_direction", "clipped_direction", "unseen_texel", "clipped_texel"];
const unseenDirection = 1;
const clippedDirection = 2;
const unseenTexel = 4;
const clippedTexel = 8;

/** `validity`: "none", with value 0, if a tile that it needs has not arrived, or D is wanted and the probe sends no
 *  texture; "stale" if the probe has newer data, or was silent for three key intervals; "invalid_query", with value 0,
 *  if an argument is not finite, the point is outside the texture, or the viewer is not in front of the plane. */
export interface PlaneAnswer {
  value: Rgb;
  validity: Validity;
  flags: ReadonlySet<PlaneFlag>;
}

/** A pinhole camera: +X right, +Y up, -Z forward. A point (x, y, z) has the pixel coordinates (cx - fx x / z,
 *  cy + fy y / z); the centre of the top left pixel is (0, 0). */
export interface PlaneCamera {
  width: number;
  height: number;
  fx: number;
  fy: number;
  cx: number;
  cy: number;
  /** T_plane_camera, with a unit quaternion. */
  pose: Pose;
}

export interface PlaneRendering {
  /** Of all pixels together: the worst. */
  validity: Validity;
  /** r, g, b, rows from the top; 0 where the plane is not seen. */
  rgb: Float32Array;
  /** Of each pixel: bits, as planeFlags. */
  flags: Uint8Array;
  /** Of each pixel: 1 where it shows the plane. */
  drawn: Uint8Array;
}

// Weights below this are rounding errors of float and count as 0, as in C++.
const minWeight = f(1e-5);
const silentKeyIntervals = 3;
const maxPixels = 32768;

const rank: Record<Validity, number> = { valid: 0, stale: 1, none: 2, invalid_query: 3 };
const worse = (a: Validity, b: Validity) => (rank[a] > rank[b] ? a : b);

/** Sum of weighted entries, rounded to float as in C++, and what is known of them. */
class Sum {
  readonly value: Rgb = [0, 0, 0];
  validity: Validity = "valid";
  bits = 0;

  add(radiance: Float32Array, at: number, weight: number): void {
    for (let k = 0; k < 3; ++k) this.value[k] = f(this.value[k] + f(radiance[3 * at + k] * weight));
  }
}

const finite = (...values: number[]) => values.every(Number.isFinite);

/** One moment of a captured plane; of PlaneReader.snapshot(). */
export class PlaneAppearance {
  /** Since the newest message, ms. */
  readonly ageMs: number;

  constructor(private readonly state: PlaneState | null, nowMs: number) {
    this.ageMs = state === null ? 0 : Math.max(0, nowMs - state.receivedMs);
  }

  /** "valid" if the newest update is complete and recent, "stale" if not, "none" if nothing was received. */
  get validity(): Validity {
    if (this.state === null) return "none";
    return this.silent || this.state.missing > 0 ? "stale" : "valid";
  }

  /** Of the newest update of which a message was received; 0: none. */
  get revision(): bigint {
    return this.state?.revision ?? 0n;
  }

  get missingTiles(): number {
    return this.state?.missing ?? 0;
  }

  /** Null if nothing was received. */
  get info(): PlaneInfo | null {
    return this.state?.info ?? null;
  }

  /** Texels along a side; 0 if the probe sends no texture. */
  get textureEdge(): number {
    return this.state?.layout.textureEdge ?? 0;
  }

  /** D by texel, rows from the top: r, g, b, and its state (0 unseen, 1 measured, 2 clipped). Do not change it. */
  get texture(): { radiance: Float32Array; state: Uint8Array } {
    return this.state?.texture ?? { radiance: new Float32Array(), state: new Uint8Array() };
  }

  /** Directions from which the plane was seen; null if nothing was received. */
  get coverage(): PlaneCoverage | null {
    return this.state?.coverage ?? null;
  }

  /** Null if nothing was received. */
  guidance(options: PlaneGuidanceOptions = {}): PlaneGuidance | null {
    return this.state === null ? null : planeGuidance(this.state.coverage, options);
  }

  /** Radiance from a point of the plane (m) towards an eye (m), in the plane's frame. */
  radiance(point: readonly [number, number], eye: Vec3, layers: PlaneLayers = "all"): PlaneAnswer {
    if (!finite(...point, ...eye) || !(eye[2] > 0)) return noAnswer("invalid_query");
    const base = this.baseValidity(layers);
    if (this.state === null || base === "none") return noAnswer("none");
    const texel = texturePoint(this.state.info, point);
    if (!inSquare(texel, this.state.info.size)) return noAnswer("invalid_query");
    return answerOf(shade(this.state, texel, [eye[0] - point[0], eye[1] - point[1], eye[2]], layers), base);
  }

  /** D at a point. */
  diffuse(point: readonly [number, number]): PlaneAnswer {
    return this.radiance(point, [0, 0, 1], "diffuse");
  }

  /** S towards a viewer; need not be normalised. */
  specular(toViewer: Vec3): PlaneAnswer {
    if (!finite(...toViewer) || !(toViewer[2] > 0)) return noAnswer("invalid_query");
    const base = this.baseValidity("specular");
    if (this.state === null || base === "none") return noAnswer("none");
    return answerOf(shade(this.state, [0, 0], toViewer, "specular"), base);
  }

  /** Draws the plane: the radiance along the ray through the centre of each pixel. */
  render(camera: PlaneCamera, layers: PlaneLayers = "all"): PlaneRendering {
    const { width, height, fx, fy, cx, cy } = camera;
    const { rotation, translation: eye } = camera.pose;
    const usable = [width, height].every((v) => Number.isInteger(v) && v >= 1 && v <= maxPixels) && fx > 0 && fy > 0 &&
      finite(fx, fy, cx, cy, ...eye) && isUnit(rotation) && eye[2] > 0;
    const pixels = usable ? width * height : 0;
    const out: PlaneRendering = {
      validity: usable ? this.baseValidity(layers) : "invalid_query",
      rgb: new Float32Array(3 * pixels), flags: new Uint8Array(pixels), drawn: new Uint8Array(pixels),
    };
    if (this.state === null || rank[out.validity] >= rank.none) return out;
    const { info } = this.state;
    const perColumn = rotate(rotation, [1 / fx, 0, 0]);
    const perRow = rotate(rotation, [0, -1 / fy, 0]);
    const first = rotate(rotation, [-cx / fx, cy / fy, -1]);
    const origin = texturePoint(info, [0, 0]);
    const one = texturePoint(info, [1, 0]);
    const c = one[0] - origin[0];
    const s = one[1] - origin[1];
    for (let row = 0, pixel = 0; row < height; ++row)
      for (let column = 0; column < width; ++column, ++pixel) {
        const ray = first.map((v, k) => v + perColumn[k] * column + perRow[k] * row) as Vec3;
        if (!(ray[2] < 0)) continue;
        const t = -eye[2] / ray[2];
        const x = eye[0] + t * ray[0];
        const y = eye[1] + t * ray[1];
        const texel: [number, number] = [c * x - s * y + origin[0], s * x + c * y + origin[1]];
        if (!inSquare(texel, info.size)) continue;
        const sum = shade(this.state, texel, [-ray[0], -ray[1], -ray[2]], layers);
        out.validity = worse(out.validity, sum.validity);
        if (sum.validity === "none") continue;
        out.rgb.set(sum.value, 3 * pixel);
        out.flags[pixel] = sum.bits;
        out.drawn[pixel] = 1;
      }
    return out;
  }

  private get silent(): boolean {
    return this.state !== null && !(this.ageMs < silentKeyIntervals * this.state.keyIntervalMs);
  }

  private baseValidity(layers: PlaneLayers): Validity {
    if (this.state === null || (layers !== "specular" && this.state.layout.textureEdge === 0)) return "none";
    return this.silent ? "stale" : "valid";
  }
}

const isUnit = (q: Quat) => Math.abs(q.reduce((sum, v) => sum + v * v, 0) - 1) < 1e-6;

function texturePoint(info: PlaneInfo, point: readonly [number, number]): [number, number] {
  const { x, y, rotation, scale } = info.textureToPlane;
  const c = Math.cos(rotation) / scale;
  const s = Math.sin(rotation) / scale;
  return [c * (point[0] - x) + s * (point[1] - y), c * (point[1] - y) - s * (point[0] - x)];
}

const inSquare = (texel: readonly [number, number], size: number) =>
  Math.abs(texel[0]) <= size / 2 && Math.abs(texel[1]) <= size / 2;

function noAnswer(validity: Validity): PlaneAnswer {
  return { value: [0, 0, 0], validity, flags: new Set() };
}

function answerOf(sum: Sum, base: Validity): PlaneAnswer {
  const validity = worse(sum.validity, base);
  if (rank[validity] >= rank.none) return noAnswer(validity);
  return { value: sum.value, validity, flags: new Set(planeFlags.filter((_, k) => (sum.bits >> k) & 1)) };
}

function freshness(state: PlaneState, part: "texture" | "lumisphere", entry: number): Validity {
  if (state.missing === 0) return "valid";
  const tile = state.layout.tileOf(part, entry);
  if (state.held[tile] === state.listed[tile]) return "valid";
  return state.held[tile] === 0n ? "none" : "stale";
}

/** The wanted layers at a point of the texture's frame within the square, towards a viewer in front of the plane. */
function shade(state: PlaneState, texel: readonly [number, number], toViewer: Vec3, layers: PlaneLayers): Sum {
  const sum = new Sum();
  const parts = [layers === "specular" ? null : textureAt(state, texel),
                 layers === "diffuse" ? null : lumisphereAt(state, toViewer)];
  for (const part of parts) {
    if (part === null) continue;
    part.value.forEach((v, k) => (sum.value[k] = f(sum.value[k] + v)));
    sum.validity = worse(sum.validity, part.validity);
    sum.bits |= part.bits;
  }
  return sum;
}

function textureAt(state: PlaneState, [px, py]: readonly [number, number]): Sum {
  const edge = state.layout.textureEdge;
  const scale = edge / state.info.size;
  const clamped = (v: number) => Math.min(Math.max(v, 0), edge - 1);
  const x = clamped(px * scale + 0.5 * edge - 0.5);
  const y = clamped(0.5 * edge - py * scale - 0.5);
  const i = Math.trunc(x);
  const j = Math.trunc(y);
  const fx = f(x - i);
  const fy = f(y - j);
  const weights = [f(f(1 - fx) * f(1 - fy)), f(fx * f(1 - fy)), f(f(1 - fx) * fy), f(fx * fy)];
  const out = new Sum();
  let seen = 0;
  weights.forEach((weight, k) => {
    if (weight < minWeight) return;
    const at = Math.min(j + (k >> 1), edge - 1) * edge + Math.min(i + (k & 1), edge - 1);
    out.validity = worse(out.validity, freshness(state, "texture", at));
    const texelState = state.texture.state[at];
    if (texelState === 0) {
      out.bits |= unseenTexel;
      return;
    }
    if (texelState === 2) out.bits |= clippedTexel;
    out.add(state.texture.radiance, at, weight);
    seen = f(seen + weight);
  });
  if (seen > 0) out.value.forEach((v, k) => (out.value[k] = f(v * f(1 / seen))));
  return out;
}

function lumisphereAt(state: PlaneState, toViewer: Vec3): Sum {
  const { grid, radiance, state: states } = state.lumisphere;
  // Scaled so that no component overflows in float.
  const largest = 1 / Math.max(...toViewer.map(Math.abs));
  const { node, weight } = grid.interpolate(toViewer.map((v) => v * largest) as Vec3);
  const out = new Sum();
  node.forEach((n, k) => {
    if (weight[k] < minWeight) return;
    out.validity = worse(out.validity, freshness(state, "lumisphere", n));
    if (states[n] === 0) out.bits |= unseenDirection;
    if (states[n] === 2) out.bits |= clippedDirection;
    out.add(radiance, n, weight[k]);
  });
  return out;
}
