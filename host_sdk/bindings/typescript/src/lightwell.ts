// Lightwell for TypeScript: connects to a probe from a browser or Node, decodes its messages and evaluates irradiance
// and radiance with the same results as the C++ SDK. No dependencies.
//
//   const probe = await connect("wss://probe.local", { token });      // rejects with ProbeError
//   // In the render loop:
//   const light = probe.latest();
//   const { value, validity, errorBound } = light.irradiance([0, 1, 0]);
//
// Messages from elsewhere: decodeDescriptor (throws DecodeError), EnvironmentKeeper, Lighting; of captured planes:
//
//   const reader = new PlaneReader();
//   socket.onmessage = ({ data }) => reader.take(new Uint8Array(data), performance.now());   // throws DecodeError
//   const { value, validity, flags } = reader.snapshot(performance.now()).radiance([0.02, 0.05], eye);
export { cubeDirection, cubeMap, maxCubeEdge } from "./cube_map.js";
export type { CubeFormat, CubeMap, CubeMapOptions } from "./cube_map.js";
export * from "./descriptor.js";
export {
  EnvironmentKeeper, environmentRadiance, isWhole, levelRadiance, mirrorMap, texelRadiance,
} from "./environment.js";
export type { EnvironmentLevel, EnvironmentMap } from "./environment.js";
export { settingsOf } from "./estimator_config.js";
export type { EstimatorConfig, EstimatorKind, EstimatorState, EstimatorUpdate } from "./estimator_config.js";
export { HemisphereGrid } from "./hemisphere_grid.js";
export { colorTemperature, estimateLight, fadeWeight } from "./light_estimate.js";
export type { ColorTemperature, LightEstimate, LightEstimateOptions, LightRequest } from "./light_estimate.js";
export { Lighting } from "./lighting.js";
export type { Answer, LightingOptions, Validity } from "./lighting.js";
export { ProbeError, encodeLinkRequest } from "./link_message.js";
export type { StatusCode } from "./link_message.js";
export {
  GgxLobe, capIrradiance, capRadiance, capZonal, cosineLobe, evaluateHarmonics, harmonicsBasis,
} from "./lobes.js";
export { PlaneAppearance, planeFlags } from "./plane_appearance.js";
export type { PlaneAnswer, PlaneCamera, PlaneFlag, PlaneLayers, PlaneRendering } from "./plane_appearance.js";
export { guidanceDiscRadius, planeGuidance, probeDirection, stereographic } from "./plane_guidance.js";
export type { PlaneCoverage, PlaneGuidance, PlaneGuidanceOptions } from "./plane_guidance.js";
export { PlaneReader } from "./plane_reader.js";
export { PlaneTileLayout, decodePlaneUpdate, maxPlaneMessageBytes } from "./plane_update.js";
export type { PlaneInfo, PlaneSimilarity, PlaneTile, PlaneUpdate, SampleState } from "./plane_update.js";
export type { WebSocketConstructor, WebSocketLike } from "./platform.js";
export { connect, defaultWebPort } from "./probe.js";
export type { Probe, ProbeEvents, ProbeInfo, ProbeOptions } from "./probe.js";
export type { Arrival, LinkState, LinkStats } from "./receiver.js";
export type {
  CalibrationReport, LensSummary, LinkStatus, ProbeCalibration, ProbeCounters, ProbeStatus, RecordingStatus,
} from "./probe_status.js";
export { encodeRecord, readRecording, recordingStart } from "./recording.js";
export type { RecordedMessage, Recording } from "./recording.js";
export { toThree } from "./three.js";
export type { ConvertedToThree, ThreeLighting, ThreeOptions } from "./three.js";
export { luminance, rotate } from "./vector.js";
export type { Pose, Quat, Rgb, Vec3 } from "./vector.js";
export { DecodeError } from "./wire.js";
