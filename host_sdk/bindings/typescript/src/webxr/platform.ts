// What this module uses of WebXR, WebGL 2 and the DOM. Declared here so that it compiles without libraries of types;
// the objects of a browser, of three.js' and of npm's @types/webxr have these members.
import type { Vec3 } from "../vector.js";

export interface XRRigidTransformLike {
  readonly position: { readonly x: number; readonly y: number; readonly z: number };
  readonly orientation: { readonly x: number; readonly y: number; readonly z: number; readonly w: number };
}
/** XRSpace: of a reference space, an anchor or a tracked image. */
export type XRSpaceLike = object;
export interface XRReferenceSpaceLike extends XRSpaceLike {
  getOffsetReferenceSpace(originOffset: XRRigidTransformLike): XRReferenceSpaceLike;
}
export interface XRSessionLike {
  readonly enabledFeatures?: readonly string[] | null;
  requestReferenceSpace(type: string): Promise<XRReferenceSpaceLike>;
  addEventListener(type: "end", listener: () => void): void;
}
export interface XRFrameLike {
  readonly session: XRSessionLike;
  getPose(space: XRSpaceLike, baseSpace: XRSpaceLike): { readonly transform: XRRigidTransformLike } | null | undefined;
}
export interface XRSessionInitLike {
  requiredFeatures?: readonly unknown[];
  optionalFeatures?: readonly unknown[];
}
export interface XRSystemLike {
  requestSession(mode: string, options?: XRSessionInitLike): Promise<XRSessionLike>;
  offerSession?(mode: string, options?: XRSessionInitLike): Promise<XRSessionLike>;
}

/** A class of the platform, whose prototype gets further members. */
export interface Interface {
  readonly prototype: Record<PropertyKey, unknown>;
}

export interface EventTargetLike {
  addEventListener(type: string, listener: (event: unknown) => void): void;
  removeEventListener(type: string, listener: (event: unknown) => void): void;
  dispatchEvent(event: unknown): boolean;
}

export interface DOMPointLike {
  readonly x: number;
  readonly y: number;
  readonly z: number;
  readonly w: number;
}
declare const DOMPointReadOnly: new (x: number, y: number, z: number, w: number) => DOMPointLike;
declare const DOMException: new (text: string, name: string) => Error;
declare const XRRigidTransform: new (position: { x: number; y: number; z: number }) => XRRigidTransformLike;

/** Of a module worker. */
export interface WorkerLike {
  onmessage: ((event: { data: unknown }) => void) | null;
  onerror: ((event: { message?: string }) => void) | null;
  postMessage(message: unknown): void;
  terminate(): void;
}

/** What WebXR's functions throw and reject with. */
export function failure(name: string, text: string): Error {
  return new DOMException(text, name);
}

export function point([x, y, z]: readonly number[], w: number): DOMPointLike {
  return new DOMPointReadOnly(x, y, z, w);
}

/** `space`, moved to `position` in it, with the same axes. */
export function movedSpace(space: XRReferenceSpaceLike, [x, y, z]: Vec3): XRReferenceSpaceLike {
  return space.getOffsetReferenceSpace(new XRRigidTransform({ x, y, z }));
}

/** A class of this browser or of the emulator that is installed; undefined without it. */
export function globalInterface(name: string): Interface | undefined {
  return (globalThis as unknown as Record<string, Interface | undefined>)[name];
}

/** navigator.xr */
export function xrSystem(): XRSystemLike | undefined {
  return (globalThis as { navigator?: { xr?: XRSystemLike } }).navigator?.xr;
}

/** The members of WebGL2RenderingContext that upload a cube map. */
export type GL = Record<
  "ACTIVE_TEXTURE" | "TEXTURE_BINDING_CUBE_MAP" | "TEXTURE_CUBE_MAP" | "TEXTURE_CUBE_MAP_POSITIVE_X" | "RGBA" |
  "RGBA16F" | "HALF_FLOAT" | "SRGB8_ALPHA8" | "UNSIGNED_BYTE" | "TEXTURE_MIN_FILTER" | "TEXTURE_MAG_FILTER" | "LINEAR" |
  "TEXTURE_WRAP_S" | "TEXTURE_WRAP_T" | "CLAMP_TO_EDGE" | "UNPACK_FLIP_Y_WEBGL" | "UNPACK_PREMULTIPLY_ALPHA_WEBGL" |
  "UNPACK_COLORSPACE_CONVERSION_WEBGL" | "UNPACK_ALIGNMENT" | "UNPACK_ROW_LENGTH" | "UNPACK_SKIP_ROWS" |
  "UNPACK_SKIP_PIXELS" | "PIXEL_UNPACK_BUFFER" | "PIXEL_UNPACK_BUFFER_BINDING" | "NONE", number> & {
  isContextLost(): boolean;
  getParameter(name: number): unknown;
  createTexture(): object | null;
  bindTexture(target: number, texture: object | null): void;
  bindBuffer(target: number, buffer: unknown): void;
  pixelStorei(name: number, value: unknown): void;
  texParameteri(target: number, name: number, value: number): void;
  texImage2D(target: number, level: number, internal: number, width: number, height: number, border: number,
             format: number, type: number, texels: Uint16Array | Uint8Array): void;
};
