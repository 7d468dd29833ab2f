// Reflection cube maps of one XRLightProbe: computed by a worker, uploaded where a binding asks for them.
import type { Lighting } from "../lighting.js";
import type { Quat } from "../vector.js";
import type { CubeRequest, CubeTexels, ReflectionFormat } from "./cube_worker.js";
import type { GL, WorkerLike } from "./platform.js";

declare const URL: new (path: string, base: string) => unknown;
declare const Worker: new (url: unknown, options: { type: "module" }) => WorkerLike;

/** Shortest time from one cube map to the next, ms. */
const periodMs = 250;

export interface ReflectionOptions {
  edge: number;
  format: ReflectionFormat;
  scale: number;
}

export class Reflections {
  private worker: WorkerLike | null = null;
  private readonly textures = new Map<GL, { texture: object; texels: CubeTexels }>();
  private texels: CubeTexels | null = null;
  private busy = false;
  private requestedMs = -Infinity;
  private lastSource: unknown = null;
  private lastRotation: Quat | null = null;

  /** changed: is called after each cube map whose texels differ from the last one's. failed: no cube map can be
   *  computed, for example because the page's policy forbids workers. */
  constructor(private readonly options: ReflectionOptions, changed: () => void, failed: (why: string) => void) {
    try {
      // In this form, bundlers find the worker's file.
      this.worker = new Worker(new URL("./cube_worker.js", (import.meta as { url: string }).url), { type: "module" });
    } catch (cause) {
      failed(`its worker could not be started (${cause})`);
      return;
    }
    this.worker.onmessage = ({ data }) => {
      this.busy = false;
      const texels = data as CubeTexels;
      if (this.texels?.every((v, i) => v === texels[i])) return;
      this.texels = texels;
      changed();
    };
    this.worker.onerror = ({ message }) => failed(message || "its worker could not be loaded");
  }

  /** Requests a cube map of this light, unless it is that of the last one or comes too early. */
  update(light: Lighting, rotation: Quat, nowMs: number): void {
    const { descriptor, environment } = light;
    if (this.worker === null || this.busy || descriptor === null || nowMs < this.requestedMs + periodMs) return;
    if (descriptor === this.lastSource && rotation.every((v, k) => v === this.lastRotation?.[k])) return;
    this.busy = true;
    this.requestedMs = nowMs;
    this.lastSource = descriptor;
    this.lastRotation = rotation;
    const request: CubeRequest = { descriptor, environment, rotation, ...this.options };
    this.worker.postMessage(request);
  }

  /** There is no estimate any more. */
  clear(): void {
    this.texels = null;
    this.lastSource = null;
  }

  /** The newest cube map as a texture of this context; null without one. Each context has one texture, which later
   *  calls fill again: applications do not delete those that they have replaced. */
  texture(gl: GL): object | null {
    if (this.texels === null) return null;
    const last = this.textures.get(gl);
    if (last?.texels === this.texels) return last.texture;
    const texture = last?.texture ?? gl.createTexture();
    if (texture === null) return null;
    upload(gl, texture, this.texels, this.options);
    this.textures.set(gl, { texture, texels: this.texels });
    return texture;
  }

  /** Textures stay, because the page may still draw with them. */
  end(): void {
    this.worker?.terminate();
    this.texels = null;
    this.textures.clear();
  }
}

/** Fills all faces and leaves the context's state as it was. */
function upload(gl: GL, texture: object, texels: CubeTexels, { edge, format }: ReflectionOptions): void {
  const bound = gl.getParameter(gl.TEXTURE_BINDING_CUBE_MAP) as object | null;
  const buffer = gl.getParameter(gl.PIXEL_UNPACK_BUFFER_BINDING);
  const unpack = ([
    [gl.UNPACK_FLIP_Y_WEBGL, false], [gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false],
    [gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE], [gl.UNPACK_ALIGNMENT, 4], [gl.UNPACK_ROW_LENGTH, 0],
    [gl.UNPACK_SKIP_ROWS, 0], [gl.UNPACK_SKIP_PIXELS, 0],
  ] as const).map(([name, value]) => ({ name, value, before: gl.getParameter(name) }));
  gl.bindTexture(gl.TEXTURE_CUBE_MAP, texture);
  gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, null);
  for (const { name, value } of unpack) gl.pixelStorei(name, value);
  const face = 4 * edge * edge;
  const [internal, type] = format === "rgba16f" ? [gl.RGBA16F, gl.HALF_FLOAT] : [gl.SRGB8_ALPHA8, gl.UNSIGNED_BYTE];
  for (let k = 0; k < 6; ++k)
    gl.texImage2D(gl.TEXTURE_CUBE_MAP_POSITIVE_X + k, 0, internal, edge, edge, 0, gl.RGBA, type,
                  texels.subarray(face * k, face * (k + 1)));
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
    gl.texParameteri(gl.TEXTURE_CUBE_MAP, name, gl.LINEAR);
  for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T])
    gl.texParameteri(gl.TEXTURE_CUBE_MAP, name, gl.CLAMP_TO_EDGE);
  for (const { name, before } of unpack) gl.pixelStorei(name, before);
  gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, buffer);
  gl.bindTexture(gl.TEXTURE_CUBE_MAP, bound);
}
