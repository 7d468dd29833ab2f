// Reconstruction of radiance from a descriptor's harmonics, for reflections: non-negative and without the ringing of a
// truncated series. Method and numbers as in proto/include/lightwell/reconstruction.hpp.
import { GgxLobe, bandOf, clamp, evaluateHarmonics, gaussLegendre, harmonicsBasis } from "./lobes.js";
import { Rgb, Vec3 } from "./vector.js";

const maxBand = 6;
const estimateBand = 4;
const variance = 1e-3;
const maxIterations = 20;
const converged = 1e-7;
const maxExponent = 40;
const floorShare = 0.1;
const rounding = 1e-5;
const faint = 1e-3;
const blurUnit = 0.1;
const maxBlur = 100;
const bisections = 11;
const directions = 512;
const knots = 5;
const sphere = 4 * Math.PI;

/** Coefficients with the missing bands estimated by maximum entropy, and t of the window exp(-t l(l+1)) at roughness 0,
 *  1/4, 1/2, 3/4, 1. */
export interface RadianceReconstruction {
  readonly coefficients: readonly Rgb[];
  readonly blur: readonly number[];
}

const count = (band: number) => (band + 1) ** 2;

let grid: { weight: number[]; y: Float64Array[] } | null = null;

/** Quadrature that is exact up to band 19: Gauss-Legendre in z, equidistant in azimuth. */
function estimateGrid() {
  if (grid) return grid;
  const rows = 10;
  const columns = 20;
  grid = { weight: [], y: [] };
  for (const { x, weight } of gaussLegendre(rows)) {
    const sine = Math.sqrt(1 - x * x);
    for (let i = 0; i < columns; ++i) {
      const phi = (2 * Math.PI * (i + 0.5)) / columns;
      grid.weight.push((weight * 2 * Math.PI) / columns);
      grid.y.push(harmonicsBasis(maxBand, [sine * Math.cos(phi), sine * Math.sin(phi), x]));
    }
  }
  return grid;
}

let spiral: Float64Array[] | null = null;

/** Values of the basis functions on an equal-area spiral of directions, at which ringing is detected. */
function windowDirections(): Float64Array[] {
  if (spiral) return spiral;
  spiral = Array.from({ length: count(maxBand) }, () => new Float64Array(directions));
  for (let n = 0; n < directions; ++n) {
    const z = 1 - (2 * n + 1) / directions;
    const sine = Math.sqrt(1 - z * z);
    const phi = n * Math.PI * (3 - Math.sqrt(5));
    const y = harmonicsBasis(maxBand, [sine * Math.cos(phi), sine * Math.sin(phi), z]);
    spiral.forEach((row, i) => { row[n] = y[i]; });
  }
  return spiral;
}

/** Mean over the sphere; 0 if the channel is not a valid radiance. */
function meanOf(sh: readonly Rgb[], k: number): number {
  const mean = sh[0][k] * Math.sqrt(0.25 / Math.PI);
  return mean > 0 && Number.isFinite(sh.reduce((sum, c) => sum + c[k], 0)) ? mean : 0;
}

function sentBands(sh: readonly Rgb[]): boolean[] {
  const sent = new Array<boolean>(maxBand + 1).fill(false);
  sh.forEach((c, i) => {
    if (c.some((v, k) => Math.abs(v) > rounding * Math.abs(sh[0][k]))) sent[bandOf(i)] = true;
  });
  return sent;
}

/** Maximum entropy by Newton's method on the dual problem. */
class MaxEntropy {
  private readonly index: number[] = [];
  private readonly y: Float64Array[];
  private lambda: Float64Array;
  private readonly flux: Float64Array;

  constructor(sent: readonly boolean[]) {
    for (let i = 0; i < count(estimateBand); ++i) if (sent[bandOf(i)]) this.index.push(i);
    this.y = estimateGrid().y.map((y) => Float64Array.from(this.index, (i) => y[i]));
    this.flux = new Float64Array(this.y.length);
    this.lambda = new Float64Array(this.index.length);
    this.lambda[0] = -Math.log(sphere) * Math.sqrt(sphere);
  }

  /** Coefficients of all bands, scaled to integral 1. Starts at the last channel's solution. */
  estimate(sh: readonly Rgb[], k: number, mean: number): number[] {
    const target = this.moments(sh, k, mean);
    let potential = this.evaluate(this.lambda, target);
    for (let iteration = 0; iteration < maxIterations; ++iteration) {
      const { step, decrement } = this.newtonStep(target);
      if (!(decrement > converged)) break;
      for (let share = 1; ; share /= 2) {
        const next = this.lambda.map((v, a) => v - share * step[a]);
        const there = this.evaluate(next, target);
        if (there < potential - 0.1 * share * decrement || share < 1e-4) {
          potential = there;
          this.lambda = next;
          break;
        }
      }
    }
    const out = new Array<number>(count(maxBand)).fill(0);
    estimateGrid().y.forEach((y, n) => {
      for (let i = 0; i < out.length; ++i) out[i] += this.flux[n] * y[i];
    });
    return out;
  }

  private moments(sh: readonly Rgb[], k: number, mean: number): number[] {
    const unit = 1 / (sphere * mean);
    const target = this.index.map((i) => sh[i][k] * unit);
    const square = new Array<number>(maxBand + 1).fill(0);
    this.index.forEach((i, a) => {
      square[bandOf(i)] += target[a] * target[a];
    });
    return target.map((v, a) => {
      if (a === 0) return v;
      const l = bandOf(this.index[a]);
      const most = 0.95 * Math.sqrt((2 * l + 1) * square[0]);
      return v * Math.min(1, most / Math.sqrt(Math.max(square[l], 1e-30)));
    });
  }

  private evaluate(lambda: Float64Array, target: readonly number[]): number {
    const { weight } = estimateGrid();
    let sum = 0;
    for (let n = 0; n < this.y.length; ++n) {
      const y = this.y[n];
      let exponent = 0;
      for (let a = 0; a < y.length; ++a) exponent += lambda[a] * y[a];
      this.flux[n] = weight[n] * Math.exp(Math.min(exponent, maxExponent));
      sum += this.flux[n];
    }
    for (let a = 0; a < lambda.length; ++a)
      sum += lambda[a] * ((a > 0 ? ((variance / 2) * lambda[a]) / sphere : 0) - target[a]);
    return sum;
  }

  private newtonStep(target: readonly number[]) {
    const m = target.length;
    const h = target.map(() => new Float64Array(m));
    const g = new Float64Array(m);
    for (let n = 0; n < this.y.length; ++n) {
      const y = this.y[n];
      for (let a = 0; a < m; ++a) {
        const q = this.flux[n] * y[a];
        const row = h[a];
        g[a] += q;
        for (let b = 0; b <= a; ++b) row[b] += q * y[b];
      }
    }
    for (let a = 0; a < m; ++a) {
      g[a] -= target[a];
      h[a][a] += 1e-12;
      if (a === 0) continue;
      g[a] += (variance * this.lambda[a]) / sphere;
      h[a][a] += variance / sphere;
    }
    const step = Float64Array.from(g);
    for (let j = 0; j < m; ++j) {
      for (let k = 0; k < j; ++k) h[j][j] -= h[j][k] * h[j][k];
      h[j][j] = Math.sqrt(Math.max(h[j][j], 1e-12));
      for (let i = j + 1; i < m; ++i) {
        for (let k = 0; k < j; ++k) h[i][j] -= h[i][k] * h[j][k];
        h[i][j] /= h[j][j];
      }
    }
    for (let i = 0; i < m; ++i) {
      for (let k = 0; k < i; ++k) step[i] -= h[i][k] * step[k];
      step[i] /= h[i][i];
    }
    for (let i = m - 1; i >= 0; --i) {
      for (let k = i + 1; k < m; ++k) step[i] -= h[k][i] * step[k];
      step[i] /= h[i][i];
    }
    let decrement = 0;
    for (let a = 0; a < m; ++a) decrement += g[a] * step[a];
    return { step, decrement };
  }
}

function completed(sh: readonly Rgb[]): Rgb[] {
  const sent = sentBands(sh);
  const out = sh.map((c): Rgb => [c[0], c[1], c[2]]);
  if (!sent.slice(1, estimateBand + 1).includes(true) || !sent.includes(false)) return out;
  while (out.length < count(maxBand)) out.push([0, 0, 0]);
  const entropy = new MaxEntropy(sent);
  for (let k = 0; k < 3; ++k) {
    const mean = meanOf(sh, k);
    if (!(mean > 0)) continue;
    const all = entropy.estimate(sh, k, mean);
    for (let i = 1; i < out.length; ++i) if (!sent[bandOf(i)]) out[i][k] = Math.fround(sphere * mean * all[i]);
  }
  return out;
}

/** The window exp(-t l(l+1)). */
function window(t: number): number[] {
  const q = Math.exp(-2 * t);
  const out = [1];
  for (let l = 1, step = 1; l <= maxBand; ++l) out.push(out[l - 1] * (step *= q));
  return out;
}

const positiveKernel: readonly number[] = (() => {
  const out = [1];
  for (let l = 1; l <= maxBand; ++l) out.push((out[l - 1] * (maxBand + 1 - l)) / (maxBand + 1 + l));
  return out;
})();

let lobes: number[][] | null = null;

function lobesAtKnots(): number[][] {
  lobes ??= Array.from({ length: knots }, (_, k) =>
    k === 0 ? new Array<number>(maxBand + 1).fill(1) : new GgxLobe(k / (knots - 1)).coefficients());
  return lobes;
}

class WindowSearch {
  private readonly channels: Float64Array[][] = [];

  constructor(sh: readonly Rgb[]) {
    const means = [0, 1, 2].map((k) => meanOf(sh, k));
    const brightest = Math.max(...means);
    const spread = windowDirections();
    means.forEach((mean, k) => {
      if (!(mean > faint * brightest)) return;
      const channel = Array.from({ length: bandOf(sh.length - 1) + 1 }, () => new Float64Array(directions));
      for (let i = 0; i < sh.length; ++i) {
        const c = sh[i][k] / mean;
        const row = channel[bandOf(i)];
        const y = spread[i];
        for (let n = 0; n < directions; ++n) row[n] += c * y[n];
      }
      this.channels.push(channel);
    });
  }

  blur(lobe: readonly number[], least: number): number {
    const around = positiveKernel.map((p, l) => p * lobe[l]);
    const floors = this.channels.map((channel) =>
      weigh(channel, around, new Float64Array(directions)).map((v) => floorShare * clamp(v, 0, 1)));
    const value = new Float64Array(directions);
    const keepsFloor = (t: number) => {
      const factor = window(t).map((w, l) => w * lobe[l]);
      return this.channels.every((channel, k) => {
        const floor = floors[k];
        weigh(channel, factor, value);
        for (let n = 0; n < directions; ++n) if (value[n] < floor[n]) return false;
        return true;
      });
    };
    if (keepsFloor(least)) return least;
    let low = least / (least + blurUnit);
    let high = 1;
    for (let step = 0; step < bisections; ++step) {
      const s = 0.5 * (low + high);
      if (keepsFloor((blurUnit * s) / (1 - s))) high = s;
      else low = s;
    }
    return high < 1 ? (blurUnit * high) / (1 - high) : maxBlur;
  }
}

function weigh(channel: readonly Float64Array[], factor: readonly number[], out: Float64Array): Float64Array {
  out.fill(0);
  channel.forEach((row, l) => {
    const k = factor[l];
    for (let n = 0; n < directions; ++n) out[n] += k * row[n];
  });
  return out;
}

export function reconstruct(sh: readonly Rgb[]): RadianceReconstruction {
  const coefficients = completed(sh);
  const blur = new Array<number>(knots).fill(0);
  if (coefficients.length <= 1) return { coefficients, blur };
  const search = new WindowSearch(coefficients);
  let t = 0;
  for (let k = knots - 1; k >= 0; --k) {
    t = search.blur(lobesAtKnots()[k], t);
    blur[k] = Math.fround(t);
  }
  return { coefficients, blur };
}

/** Mean radiance over the lobe of `roughness` about the unit vector d; `lobe`: its coefficients, ones for a mirror. */
export function radianceAt(r: RadianceReconstruction, d: Vec3, roughness: number, lobe: readonly number[]): Rgb {
  const at = clamp(roughness, 0, 1) * (knots - 1);
  const knot = Math.min(Math.floor(at), knots - 2);
  const share = (at * at - knot * knot) / (2 * knot + 1);
  const t = r.blur[knot] * (1 - share) + r.blur[knot + 1] * share;
  const value = evaluateHarmonics(r.coefficients, d, window(t).map((w, l) => w * lobe[l]));
  // The order of the comparison maps NaN to 0.
  return [value[0] > 0 ? value[0] : 0, value[1] > 0 ? value[1] : 0, value[2] > 0 ? value[2] : 0];
}
