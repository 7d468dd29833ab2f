// In a page: calls of WebXR's light estimation with an emulated device, and how they fail.
import { XRDevice, metaQuest3 } from "iwer";
import { provideLightEstimation } from "lightwell/webxr";

/** An emulated device. features: further ones that it has itself. */
export function installDevice(features = []) {
  const config = { ...metaQuest3, supportedFeatures: [...metaQuest3.supportedFeatures, ...features] };
  globalThis.device = new XRDevice(config);
  globalThis.device.installRuntime({ forceInstall: true });
}

/** "NAME: MESSAGE" of what the function throws or rejects with; otherwise its value. */
export async function attempt(call) {
  try {
    return await call();
  } catch (error) {
    const known = error instanceof DOMException || error instanceof TypeError;
    return `${known ? error.name : "another error"}: ${error.message}`;
  }
}

export async function provide(address, options) {
  globalThis.estimation = await provideLightEstimation(address, options);
  return "provided";
}

/** A session with frames, and a light probe in it. */
export async function start(init = { requiredFeatures: ["light-estimation"] },
                            probeInit = { reflectionFormat: "rgba16f" }) {
  const session = await navigator.xr.requestSession("immersive-ar", init);
  const gl = document.createElement("canvas").getContext("webgl2");
  session.updateRenderState({ baseLayer: new XRWebGLLayer(session, gl) });
  globalThis.base = await session.requestReferenceSpace("local");
  const probe = await session.requestLightProbe(probeInit);
  Object.assign(globalThis, { session, gl, probe, binding: new XRWebGLBinding(session, gl), changes: 0 });
  probe.onreflectionchange = ({ type }) => (globalThis.changes += type === "reflectionchange" ? 1 : 0);
  return [...session.enabledFeatures];
}

/** Value of the function for the next frame of the session. */
export function inFrame(call) {
  return new Promise((resolve, reject) => session.requestAnimationFrame((_, frame) => {
    try {
      resolve(call(frame));
    } catch (error) {
      reject(error);
    }
  }));
}

const point = ({ x, y, z, w }) => [x, y, z, w];

/** The estimate of the next frame, as arrays. */
export function estimate() {
  return inFrame((frame) => {
    const found = frame.getLightEstimate(probe);
    return found && {
      harmonics: [...found.sphericalHarmonicsCoefficients], direction: point(found.primaryLightDirection),
      intensity: point(found.primaryLightIntensity),
    };
  });
}

/** Texels of a face of the reflection cube map, read from the texture; null without one. */
export function cubeFace(face, edge = 16) {
  const texture = binding.getReflectionCubeMap(probe);
  if (texture === null) return null;
  const framebuffer = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
  gl.getExtension("EXT_color_buffer_float");
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_CUBE_MAP_POSITIVE_X + face, texture, 0);
  const out = gl.getParameter(gl.IMPLEMENTATION_COLOR_READ_TYPE) === gl.UNSIGNED_BYTE ?
    new Uint8Array(4 * edge * edge) : new Float32Array(4 * edge * edge);
  gl.readPixels(0, 0, edge, edge, gl.RGBA, out instanceof Uint8Array ? gl.UNSIGNED_BYTE : gl.FLOAT, out);
  gl.deleteFramebuffer(framebuffer);
  return [...out];
}

/** The state of the context that an upload of texels could change. */
export function glState() {
  return JSON.stringify([gl.UNPACK_FLIP_Y_WEBGL, gl.UNPACK_ALIGNMENT, gl.UNPACK_ROW_LENGTH, gl.ACTIVE_TEXTURE,
                         gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL].map((name) => gl.getParameter(name)));
}
