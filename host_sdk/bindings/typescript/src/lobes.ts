// Spherical harmonics, cosine and GGX lobes, caps of uniform radiance, as in proto/include/lightwell.
import { Rgb, Vec3 } from "./vector.js";

/** Coefficients A_l of the clamped cosine (Ramamoorthi & Hanrahan 2001, eq. 8). */
export const cosineLobe: readonly number[] =
  [Math.PI, (2 * Math.PI) / 3, Math.PI / 4, 0, -Math.PI / 24, 0, Math.PI / 64];

/** The band of coefficient l(l+1)+m. */
export const bandOf = (index: number) => Math.floor(Math.sqrt(index));

/** Values of the functions of bands 0 to `band` at the unit vector d, in the order l(l+1)+m: Legendre recursion
 *  without the sine factor (Sloan 2013). */
export function harmonicsBasis(band: number, d: Vec3): Float64Array {
  const out = new Float64Array((band + 1) ** 2);
  let re = 1;
  let im = 0;
  let diagonal = Math.sqrt(0.25 / Math.PI);
  for (let m = 0; m <= band; ++m) {
    if (m > 0) diagonal *= Math.sqrt((2 * m + 1) / (2 * m));
    let previous = 0;
    let current = m > 0 ? Math.SQRT2 * diagonal : diagonal;
    for (let l = m; ; ++l) {
      out[l * (l + 1) + m] = current * re;
      if (m > 0) out[l * (l + 1) - m] = current * im;
      if (l === band) break;
      const next = l + 1;
      const a = Math.sqrt((4 * next * next - 1) / (next * next - m * m));
      const b = Math.sqrt((l * l - m * m) / (4 * l * l - 1));
      [previous, current] = [current, a * (d[2] * current - b * previous)];
    }
    [re, im] = [re * d[0] - im * d[1], re * d[1] + im * d[0]];
  }
  return out;
}

/** The sum of coefficients times functions, each band l times factor[l]. */
export function evaluateHarmonics(coefficients: readonly Rgb[], d: Vec3, factor?: readonly number[]): Rgb {
  const band = Math.round(Math.sqrt(coefficients.length)) - 1;
  const y = harmonicsBasis(band, d);
  const sum: Rgb = [0, 0, 0];
  for (let l = 0, i = 0; l <= band; ++l)
    for (; i < (l + 1) ** 2; ++i) {
      const k = y[i] * (factor ? factor[l] : 1);
      for (let c = 0; c < 3; ++c) sum[c] += coefficients[i][c] * k;
    }
  return sum;
}

/** Radius below which the cap is treated as a point: the error is less than the closed forms' cancellation error. */
const pointRadius = 2e-5;
const halfPi = Math.PI / 2;
export const clamp = (v: number, low: number, high: number) => Math.min(Math.max(v, low), high);

/** Legendre polynomials P_{l-1} and P_l at x; P_{-1} is 1. */
function legendre(l: number, x: number): [number, number] {
  let previous = 1;
  let p = l > 0 ? x : 1;
  for (let n = 2; n <= l; ++n) [previous, p] = [p, ((2 * n - 1) * x * p - (n - 1) * previous) / n];
  return [previous, p];
}

/** Irradiance of a flat receiver per vector irradiance of the cap, clipped at the receiver's horizon (Snyder 1996). */
export function capIrradiance(cosAngle: number, radius: number): number {
  const sigma = clamp(radius, 0, halfPi);
  const c = clamp(cosAngle, -1, 1);
  if (sigma < pointRadius) return Math.max(0, c);
  const omega = Math.acos(c);
  if (omega <= halfPi - sigma) return c;
  if (omega >= halfPi + sigma) return 0;
  const sinS = Math.sin(sigma);
  const cosS = Math.cos(sigma);
  const sinW = Math.sin(omega);
  const gamma = Math.asin(clamp(cosS / sinW, -1, 1));
  const cosG = Math.cos(gamma);
  const sinG = Math.sin(gamma);
  const g = -2 * sinW * cosS * cosG + halfPi - gamma + sinG * cosG;
  const h = c * (cosG * Math.sqrt(Math.max(0, sinS * sinS - cosG * cosG)) +
                 sinS * sinS * Math.asin(clamp(cosG / sinS, -1, 1)));
  const full = Math.PI * sinS * sinS;
  return Math.max(0, (omega < halfPi ? full * c + g - h : g + h) / full);
}

/** SH coefficient of the cap: c_lm = capZonal(l, radius) Y_lm(axis), per vector irradiance. */
export function capZonal(l: number, radius: number): number {
  const sigma = clamp(radius, 0, halfPi);
  if (sigma < pointRadius) return 1;
  const a = Math.cos(sigma);
  const sinS = Math.sin(sigma);
  return (2 * Math.PI * (legendre(l, a)[0] - legendre(l + 1, a)[1])) / (2 * l + 1) / (Math.PI * sinS * sinS);
}

/** Nodes and weights of n-point Gauss-Legendre quadrature on [-1, 1], x decreasing. */
export const gaussLegendre = (n: number) => Array.from({ length: n }, (_, i) => {
  let x = Math.cos((Math.PI * (i + 0.75)) / (n + 0.5));
  let slope = 1;
  for (let step = 0; step < 50; ++step) {
    const [p0, p1] = legendre(n, x);
    slope = (n * (x * p1 - p0)) / (x * x - 1);
    x -= p1 / slope;
  }
  return { x, weight: 2 / ((1 - x * x) * slope * slope) };
});

/** On [0, 1]. */
const gauss = gaussLegendre(32).map(({ x, weight }) => ({ node: 0.5 * (1 - x), weight: 0.5 * weight }));

/** The lobe of radiance(d, r): GGX with N = V = R = d, weighted by N·L, normalised to one (Karis 2013). */
export class GgxLobe {
  static readonly minRoughness = 0.02;
  private readonly alpha2: number;
  private readonly beta: number;
  private readonly norm: number;

  constructor(roughness: number) {
    const r = roughness < 1 ? Math.max(roughness, GgxLobe.minRoughness) : 1;
    this.alpha2 = r ** 4;
    this.beta = (1 - this.alpha2) / 2;
    this.norm = 1;
    this.norm = 1 / (2 * Math.PI * this.integral(0, 1, () => 1));
  }

  value(x: number): number {
    if (!(x > 0)) return 0;
    const d = this.alpha2 + this.beta * Math.max(0, 1 - x);
    return (this.norm * x * this.alpha2) / (d * d);
  }

  /** Integral of value(x) f(x) from x0 to x1 in the logarithm of the denominator, in which there is no sharp peak. */
  integral(x0: number, x1: number, f: (x: number) => number): number {
    const y0 = 1 - x1;
    const y1 = 1 - x0;
    let sum = 0;
    if (this.beta < 1e-6) {
      for (const { node, weight } of gauss) {
        const y = y0 + (y1 - y0) * node;
        sum += weight * this.value(1 - y) * f(1 - y);
      }
      return sum * (y1 - y0);
    }
    const u0 = Math.log1p((this.beta / this.alpha2) * y0);
    const u1 = Math.log1p((this.beta / this.alpha2) * y1);
    for (const { node, weight } of gauss) {
      const u = u0 + (u1 - u0) * node;
      const y = (this.alpha2 / this.beta) * Math.expm1(u);
      sum += (weight * this.value(1 - y) * f(1 - y) * this.alpha2 * Math.exp(u)) / this.beta;
    }
    return sum * (u1 - u0);
  }

  /** Legendre coefficients: convolution multiplies band l by the l-th of them. */
  coefficients(): number[] {
    return Array.from({ length: 7 }, (_, l) => 2 * Math.PI * this.integral(0, 1, (x) => legendre(l, x)[1]));
  }
}

/** radiance(d, r) of the cap per vector irradiance, sr⁻¹: the lobe around d integrated over the cap. */
export function capRadiance(cosAngle: number, radius: number, lobe: GgxLobe): number {
  const sigma = clamp(radius, 0, halfPi);
  const c = clamp(cosAngle, -1, 1);
  if (sigma < pointRadius) return lobe.value(c);
  const omega = Math.acos(c);
  // Integrate over rings of polar angle t around the lobe's axis; a fraction of each is inside the cap.
  const first = Math.max(0, omega - sigma);
  const last = Math.min(omega + sigma, halfPi);
  if (first >= last) return 0;
  const sinW = Math.sin(omega);
  const cosS = Math.cos(sigma);
  const share = (x: number) => {
    const reach = sinW * Math.sqrt(Math.max(0, 1 - x * x));
    if (reach < 1e-15) return x * c >= cosS ? 1 : 0;
    return Math.acos(clamp((cosS - c * x) / reach, -1, 1)) / Math.PI;
  };
  const whole = sigma > omega ? sigma - omega : 0;
  let sum = 0;
  if (whole > 0) sum += lobe.integral(Math.cos(Math.min(whole, halfPi)), 1, () => 1);
  const a = Math.cos(last);
  const b = Math.cos(Math.max(first, whole));
  const pieces = 4;
  const knot = (k: number) => a + (b - a) * (0.5 - 0.5 * Math.cos((Math.PI * k) / pieces));
  for (let i = 0; i < pieces && a < b; ++i) sum += lobe.integral(knot(i), knot(i + 1), share);
  const sinS = Math.sin(sigma);
  return (2 * Math.PI * sum) / (Math.PI * sinS * sinS);
}
