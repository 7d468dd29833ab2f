// What the module changes in the browser: navigator.xr grants the feature "light-estimation", and the interfaces of
// WebXR have the members of the Lighting Estimation API.
import type { ReflectionFormat } from "./cube_worker.js";
import {
  GL, Interface, XRFrameLike, XRSessionInitLike, XRSessionLike, XRSystemLike, failure, globalInterface, xrSystem,
} from "./platform.js";
import { LightEstimate, LightProbe, SessionLight, SessionOptions } from "./session_light.js";

const feature = "light-estimation";
const preferredFormat: ReflectionFormat = "rgba16f";

/** "replace": sessions get the probe's light. "prefer": the browser's own, where it grants that. */
export type NativeEstimation = "replace" | "prefer";

/** Sessions that the module has granted the feature. */
const grants = new WeakMap<XRSessionLike, { options: SessionOptions; ended: boolean }>();
/** Session and context of bindings. */
const bindings = new WeakMap<object, { session: XRSessionLike; gl: GL }>();
const extended = new WeakSet<object>();
let providing = false;

type Method = (this: unknown, ...args: never[]) => unknown;

/** Replaces a method; `make` receives the browser's own. */
function override({ prototype }: Interface, name: string, make: (native: Method | undefined) => Method): void {
  const native = prototype[name] as Method | undefined;
  Object.defineProperty(prototype, name, { value: make(native), configurable: true, writable: true });
}

function requestLightProbe(native: Method | undefined): Method {
  return async function (this: unknown, init?: { reflectionFormat?: string }) {
    const session = this as XRSessionLike;
    const grant = grants.get(session);
    if (!grant) {
      if (native) return native.call(session, init as never);
      throw failure("NotSupportedError",
                    `this session has no '${feature}': name it in requiredFeatures or optionalFeatures`);
    }
    if (grant.ended) throw failure("InvalidStateError", "the session has ended");
    const format = init?.reflectionFormat ?? "srgba8";
    if (format !== "srgba8" && format !== preferredFormat)
      throw new TypeError(`'${format}' is no XRReflectionFormat: srgba8 or rgba16f`);
    const light = await SessionLight.start(session, grant.options, format);
    return light.probe;
  };
}

function getLightEstimate(native: Method | undefined): Method {
  return function (this: unknown, probe: unknown) {
    const frame = this as XRFrameLike;
    if (probe instanceof LightProbe) {
      if (probe.light.session !== frame.session)
        throw failure("InvalidStateError", "the light probe is of another session");
      return probe.light.estimateAt(frame);
    }
    if (native) return native.call(frame, probe as never);
    throw new TypeError("getLightEstimate: the argument is no XRLightProbe");
  };
}

function getReflectionCubeMap(native: Method | undefined): Method {
  return function (this: unknown, probe: unknown) {
    if (!(probe instanceof LightProbe)) {
      if (native) return native.call(this, probe as never);
      throw new TypeError("getReflectionCubeMap: the argument is no XRLightProbe");
    }
    const binding = bindings.get(this as object);
    if (!binding) throw failure("InvalidStateError", "the binding was made before provideLightEstimation()");
    if (binding.gl.isContextLost()) throw failure("InvalidStateError", "the context is lost");
    if (probe.light.ended) throw failure("InvalidStateError", "the session has ended");
    if (probe.light.session !== binding.session)
      throw failure("InvalidStateError", "the light probe is of another session");
    if (!(binding.gl.RGBA16F > 0))
      throw failure("NotSupportedError", "reflection cube maps need a WebGL 2 context");
    return probe.light.cubeMap(binding.gl);
  };
}

/** Bindings do not tell their session and context, so that their construction is observed. */
function observedBindings(binding: Interface): unknown {
  return new Proxy(binding as unknown as new (...args: unknown[]) => object, {
    construct(target, args, newTarget) {
      const made = Reflect.construct(target, args, newTarget) as object;
      bindings.set(made, { session: args[0] as XRSessionLike, gl: args[1] as GL });
      return made;
    },
  });
}

/** WebXR of the browser or of its emulator. Throws NotSupportedError without. */
export function webXr(): { xr: XRSystemLike; session: Interface; frame: Interface } {
  const xr = xrSystem();
  const [session, frame] = [globalInterface("XRSession"), globalInterface("XRFrame")];
  if (!xr || !session || !frame)
    throw failure("NotSupportedError", "this page has no WebXR: it needs a browser with WebXR and https:// or " +
      "localhost, or an emulator such as npm's iwer, installed before");
  return { xr, session, frame };
}

/** Adds the members to the interfaces, once each. */
function extendInterfaces(session: Interface, frame: Interface): void {
  if (!extended.has(session.prototype)) {
    extended.add(session.prototype);
    override(session, "requestLightProbe", requestLightProbe);
    override(frame, "getLightEstimate", getLightEstimate);
    const { get } = Object.getOwnPropertyDescriptor(session.prototype, "preferredReflectionFormat") ?? {};
    Object.defineProperty(session.prototype, "preferredReflectionFormat", {
      get(this: XRSessionLike) {
        return get && !grants.has(this) ? get.call(this) : preferredFormat;
      },
      configurable: true,
    });
  }
  const scope = globalThis as unknown as Record<string, unknown>;
  const binding = globalInterface("XRWebGLBinding");
  if (binding && !extended.has(binding.prototype)) {
    extended.add(binding.prototype);
    override(binding, "getReflectionCubeMap", getReflectionCubeMap);
    scope.XRWebGLBinding = observedBindings(binding);
  }
  // Chromium has its own, which stay, because other sessions use them.
  scope.XRLightProbe ??= LightProbe;
  scope.XRLightEstimate ??= LightEstimate;
}

function listOf(features: readonly unknown[] | undefined): unknown[] {
  return features === undefined ? [] : Array.from(features);
}

/** Grants the feature to sessions from now on; the returned function ends that. Throws NotSupportedError without WebXR,
 *  InvalidStateError if a provider is installed already. */
export function installProvider(options: SessionOptions, native: NativeEstimation): () => void {
  if (providing) throw failure("InvalidStateError", "another probe gives its light already: call its end() before");
  const interfaces = webXr();
  const { xr } = interfaces;
  extendInterfaces(interfaces.session, interfaces.frame);
  providing = true;

  const wrap = (name: "requestSession" | "offerSession") => {
    const own = Object.getOwnPropertyDescriptor(xr, name);
    const original = xr[name];
    if (!original) return () => {};
    const request = async (mode: string, init?: XRSessionInitLike | null) => {
      const required = listOf(init?.requiredFeatures);
      const optional = listOf(init?.optionalFeatures);
      if (!required.includes(feature) && !optional.includes(feature)) return original.call(xr, mode, init ?? {});
      const { state, lastError } = options.probe.stats();
      if (required.includes(feature) && state !== "connected")
        throw failure("NotSupportedError", `'${feature}' is required, and the probe cannot be reached: ${lastError}`);
      const other = (one: unknown) => one !== feature;
      // No await before this call: it needs the user's gesture.
      const session = await original.call(xr, mode, {
        ...init, requiredFeatures: required.filter(other),
        optionalFeatures: [...optional.filter(other), ...(native === "prefer" ? [feature] : [])],
      });
      const enabled = session.enabledFeatures ?? [];
      if (enabled.includes(feature)) return session;
      const grant = { options, ended: false };
      grants.set(session, grant);
      session.addEventListener("end", () => (grant.ended = true));
      Object.defineProperty(session, "enabledFeatures", {
        value: Object.freeze([...enabled, feature]), configurable: true, enumerable: true,
      });
      return session;
    };
    Object.defineProperty(xr, name, { value: request, configurable: true, writable: true });
    return () => {
      if (own) Object.defineProperty(xr, name, own);
      else delete (xr as unknown as Record<string, unknown>)[name];
    };
  };
  const undo = [wrap("requestSession"), wrap("offerSession")];
  return () => {
    providing = false;
    undo.forEach((one) => one());
  };
}
