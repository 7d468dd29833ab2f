// The light as an XRLightEstimate (WebXR Lighting Estimation API Level 1): as to_webxr() of conventions.hpp.
import type { Lighting, Validity } from "../lighting.js";
import { bandOf } from "../lobes.js";
import { toThree } from "../three.js";
import type { Rgb, Vec3 } from "../vector.js";

/** Signs of the functions of odd order m. The specification does not define them. three.js expects "positive";
 *  Chromium's own estimates have those of ARCore, "condon_shortley". */
export type ShSigns = "positive" | "condon_shortley";

export interface WebXrOptions {
  /** Default: "positive". */
  signs?: ShSigns;
  /** How the strongest light is represented: as the primary light, or only in the harmonics. Default: "apart". */
  primaryLight?: "apart" | "in_harmonics";
  /** Factor of every value. Default: 1 (cd/m², lux, if units are absolute). */
  scale?: number;
}

/** The members of an XRLightEstimate. */
export interface WebXrLightEstimate {
  /** r, g, b of each of nine coefficients of radiance, without a separate primary light. */
  sphericalHarmonicsCoefficients: Float32Array;
  /** Towards the light; unit. [0, 1, 0] without one. */
  primaryLightDirection: Vec3;
  /** Irradiance at normal incidence. [0, 0, 0] without one. */
  primaryLightIntensity: Rgb;
  /** Of the Lighting; "invalid_query" where values are not finite. */
  validity: Validity;
}

/** Order m of coefficient l(l+1)+m is odd. */
const isOdd = (index: number) => (index - bandOf(index) * (bandOf(index) + 1)) % 2 !== 0;

/** Without an estimate (validity "none" or "invalid_query") all values are 0. */
export function toWebXr(light: Lighting, options: WebXrOptions = {}): WebXrLightEstimate {
  const { signs = "positive", primaryLight = "apart", scale = 1 } = options;
  const { value: { sh, position, color, intensity }, validity } =
    toThree(light, { mainLight: primaryLight, residual: "left_out", color: [scale, 0, 0, 0, scale, 0, 0, 0, scale] });
  const sign = (index: number) => (signs === "condon_shortley" && isOdd(Math.floor(index / 3)) ? -1 : 1);
  return {
    sphericalHarmonicsCoefficients: Float32Array.from(sh, (v, i) => sign(i) * v),
    primaryLightDirection: position,
    primaryLightIntensity: color.map((v) => v * intensity) as Rgb,
    validity,
  };
}
