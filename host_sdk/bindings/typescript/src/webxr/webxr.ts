// WebXR's light estimation from a Lightwell probe, for pages and libraries that know nothing of Lightwell:
//
//   import { provideLightEstimation } from "lightwell/webxr";
//   await provideLightEstimation("wss://probe.local", { token, pose });
//   // From here on navigator.xr grants "light-estimation", and session.requestLightProbe() gives the probe's light.
export { toWebXr } from "./light_estimate.js";
export type { ShSigns, WebXrLightEstimate, WebXrOptions } from "./light_estimate.js";
export { provideLightEstimation } from "./provider.js";
export type { LightEstimation, LightEstimationOptions } from "./provider.js";
export type { ProbeSpace } from "./session_light.js";
