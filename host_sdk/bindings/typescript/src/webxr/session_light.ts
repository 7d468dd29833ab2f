// The light of one session: where the probe is in its space, estimates, cube maps.
import type { Descriptor } from "../descriptor.js";
import type { Lighting } from "../lighting.js";
import type { Probe } from "../probe.js";
import { Pose, Quat, Vec3 } from "../vector.js";
import type { ReflectionFormat } from "./cube_worker.js";
import { ShSigns, toWebXr } from "./light_estimate.js";
import {
  DOMPointLike, EventTargetLike, GL, XRFrameLike, XRReferenceSpaceLike, XRSessionLike, XRSpaceLike, failure,
  movedSpace, point,
} from "./platform.js";
import { Reflections } from "./reflections.js";
import { composedPoses, rotatedLighting, transformed } from "./rotation.js";

declare const performance: { now(): number };
declare const EventTarget: new () => EventTargetLike;
declare const Event: new (type: string) => object;

/** Age above which there is no estimate, ms: with a frame's time, less than half a second. As in the OpenXR layer. */
const maxAgeMs = 400;
/** Movement of the light's origin that moves the probe's space, m. */
const movementM = 1e-3;

/** Space in which the pose of the probe holds: a type of reference space ("viewer": the probe is fixed to the headset),
 *  or a function that returns it for a session, for example the `anchorSpace` of an anchor. */
export type ProbeSpace = string | ((session: XRSessionLike) => XRSpaceLike | Promise<XRSpaceLike>);

/** What all sessions have in common. */
export interface SessionOptions {
  probe: Probe;
  /** T_space_probe. */
  pose: () => Pose;
  space: ProbeSpace;
  scale: number;
  signs: ShSigns;
  detail: "all" | "harmonics";
  reflectionEdge: number;
  reflectionFailed: (why: string) => void;
}

/** XRLightEstimate */
export class LightEstimate {
  constructor(readonly sphericalHarmonicsCoefficients: Float32Array, readonly primaryLightDirection: DOMPointLike,
              readonly primaryLightIntensity: DOMPointLike) {}
}

/** XRLightProbe */
export class LightProbe extends EventTarget {
  private handler: ((event: unknown) => void) | null = null;

  constructor(readonly light: SessionLight) {
    super();
  }

  get probeSpace(): XRSpaceLike {
    return this.light.probeSpace;
  }

  get onreflectionchange(): ((event: unknown) => void) | null {
    return this.handler;
  }

  set onreflectionchange(handler: ((event: unknown) => void) | null) {
    if (this.handler) this.removeEventListener("reflectionchange", this.handler);
    this.handler = typeof handler === "function" ? handler : null;
    if (this.handler) this.addEventListener("reflectionchange", this.handler);
  }
}

/** Serves one XRLightProbe. Estimates are in the axes of the session's reference space "local" (those of "local-floor",
 *  too), wherever the probe is, because applications do not transform them by the probe's space. */
export class SessionLight {
  readonly probe = new LightProbe(this);
  private readonly reflections: Reflections | null;
  private estimate: LightEstimate | null = null;
  private estimated: { descriptor: Descriptor; rotation: Quat } | null = null;
  private origin: Vec3;
  private space: XRReferenceSpaceLike;
  private over = false;

  private constructor(readonly session: XRSessionLike, private readonly base: XRReferenceSpaceLike,
                      private readonly poseSpace: XRSpaceLike | null, private readonly options: SessionOptions,
                      format: ReflectionFormat) {
    this.origin = options.pose().translation;
    this.space = movedSpace(base, this.origin);
    const { scale, reflectionEdge: edge, reflectionFailed } = options;
    this.reflections = options.detail === "harmonics" ? null : new Reflections(
      { edge, format, scale }, () => this.probe.dispatchEvent(new Event("reflectionchange")), reflectionFailed);
    session.addEventListener("end", () => this.end());
  }

  /** Rejects with NotSupportedError if the session has no such space. */
  static async start(session: XRSessionLike, options: SessionOptions, format: ReflectionFormat): Promise<SessionLight> {
    const { space } = options;
    const reference = async (type: string) => {
      try {
        return await session.requestReferenceSpace(type);
      } catch (cause) {
        throw failure("NotSupportedError", `the probe's light needs the reference space '${type}', which this ` +
          `session does not have (${cause}): request it as a feature, or name another one as option 'space'`);
      }
    };
    const base = await reference("local");
    const poseSpace = typeof space === "function" ? await space(session) : space === "local" ? null
      : await reference(space);
    return new SessionLight(session, base, poseSpace, options, format);
  }

  get probeSpace(): XRSpaceLike {
    return this.space;
  }

  get ended(): boolean {
    return this.over;
  }

  /** XRFrame.getLightEstimate(); null while there is no light, it is old, or the probe's space is not tracked. */
  estimateAt(frame: XRFrameLike): LightEstimate | null {
    // Throws InvalidStateError outside of the frame's callback.
    const pose = this.poseAt(frame);
    const light = this.options.probe.latest();
    const { descriptor } = light;
    if (pose === null || descriptor === null || !(light.ageMs <= maxAgeMs)) {
      this.estimate = this.estimated = null;
      this.reflections?.clear();
      return null;
    }
    const { rotation } = pose;
    if (descriptor !== this.estimated?.descriptor || rotation.some((v, k) => v !== this.estimated!.rotation[k])) {
      this.estimate = this.convert(light, rotation);
      this.estimated = { descriptor, rotation };
      this.move(transformed(pose, descriptor.origin.translation));
    }
    this.reflections?.update(light, rotation, performance.now());
    return this.estimate;
  }

  /** XRWebGLBinding.getReflectionCubeMap() */
  cubeMap(gl: GL): object | null {
    return this.reflections?.texture(gl) ?? null;
  }

  private convert(light: Lighting, rotation: Quat): LightEstimate | null {
    const { scale, signs, detail } = this.options;
    const value = toWebXr(rotatedLighting(light, rotation),
                          { scale, signs, primaryLight: detail === "harmonics" ? "in_harmonics" : "apart" });
    if (value.validity === "invalid_query") return null;
    return new LightEstimate(value.sphericalHarmonicsCoefficients, point(value.primaryLightDirection, 0),
                             point(value.primaryLightIntensity, 1));
  }

  /** T_base_probe at the frame's time; null while the probe's space is not tracked. */
  private poseAt(frame: XRFrameLike): Pose | null {
    const found = frame.getPose(this.poseSpace ?? this.base, this.base);
    if (!found) return null;
    if (this.poseSpace === null) return this.options.pose();
    const { position: p, orientation: q } = found.transform;
    return composedPoses({ rotation: [q.x, q.y, q.z, q.w], translation: [p.x, p.y, p.z] }, this.options.pose());
  }

  private move(origin: Vec3): void {
    if (Math.hypot(...origin.map((v, k) => v - this.origin[k])) < movementM) return;
    this.origin = origin;
    this.space = movedSpace(this.base, origin);
  }

  private end(): void {
    this.over = true;
    this.reflections?.end();
  }
}
