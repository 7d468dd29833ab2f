// The worker that computes reflection cube maps, because one takes longer than a frame.
import { cubeMap } from "../cube_map.js";
import type { Descriptor } from "../descriptor.js";
import type { EnvironmentMap } from "../environment.js";
import { Lighting } from "../lighting.js";
import { Quat, luminance } from "../vector.js";
import { rotatedLighting } from "./rotation.js";

export type ReflectionFormat = "srgba8" | "rgba16f";

export interface CubeRequest {
  descriptor: Descriptor;
  environment: EnvironmentMap | null;
  /** Of T_base_probe. */
  rotation: Quat;
  edge: number;
  format: ReflectionFormat;
  scale: number;
}

/** Faces +X, -X, +Y, -Y, +Z, -Z, RGBA: half floats, or sRGB code values. */
export type CubeTexels = Uint16Array | Uint8Array;

/** The transfer function of sRGB (IEC 61966-2-1), 0 to 255. */
function srgbCode(linear: number): number {
  const v = Math.min(linear, 1);
  return Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
}

/** The light that a reflection shows: without the strongest light, which is the estimate's primary light. */
export function renderCube({ descriptor, environment, rotation, edge, format, scale }: CubeRequest): CubeTexels {
  const rotated = rotatedLighting(new Lighting(descriptor, { environment }), rotation);
  const brightest = Math.max(...rotated.lights.map((one) => luminance(one.irradiance)));
  const primary = rotated.lights.findIndex((one) => luminance(one.irradiance) === brightest);
  const light = new Lighting({ ...rotated.descriptor!, lights: rotated.lights.filter((_, i) => i !== primary) },
                             { environment: rotated.environment });
  if (format === "rgba16f") return cubeMap(light, { edge, scale }).texels as Uint16Array;
  const linear = cubeMap(light, { edge, scale, format: "rgba32f" }).texels;
  return Uint8Array.from(linear, (v, i) => (i % 4 === 3 ? 255 : srgbCode(v)));
}

interface WorkerScope {
  onmessage: ((event: { data: CubeRequest }) => void) | null;
  postMessage(message: CubeTexels, transfer: unknown[]): void;
}
const scope = globalThis as unknown as WorkerScope & { WorkerGlobalScope?: unknown };
if (scope.WorkerGlobalScope !== undefined)
  scope.onmessage = ({ data }) => {
    const texels = renderCube(data);
    scope.postMessage(texels, [texels.buffer]);
  };
