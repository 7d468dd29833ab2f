// provideLightEstimation(): connects to the probe and installs the module in navigator.xr.
import { ProbeError } from "../link_message.js";
import { Probe, ProbeOptions, connect } from "../probe.js";
import type { Pose } from "../vector.js";
import { NativeEstimation, installProvider, webXr } from "./installation.js";
import type { ShSigns } from "./light_estimate.js";
import { failure } from "./platform.js";
import type { ProbeSpace, SessionOptions } from "./session_light.js";

export interface LightEstimationOptions extends ProbeOptions {
  /** Pose of the probe in `space`, T_space_probe: metres, quaternion. Default: the mounting that the probe reports
   *  (`lightwelld --mounting`), whose room is then `space`; without a mounting the identity. */
  pose?: Pose;
  /** Default: "local", whose axes and floor position are those of "local-floor". */
  space?: ProbeSpace;
  /** Factor of every radiance and irradiance, 1e-9 to 1e9. Pages written for a headset's own estimate expect values
   *  around 1, those of a calibrated probe are in cd/m² and lux. Default: 1. */
  scale?: number;
  /** Default: "positive", which three.js expects. */
  signs?: ShSigns;
  /** "harmonics": no primary light apart from the harmonics, and no cube map. Default: "all". */
  detail?: "all" | "harmonics";
  /** Texels along an edge of a reflection cube map: 8, 16, 32 or 64. Default: 16. */
  reflectionEdge?: number;
  /** Which light a session gets where the browser can estimate it, too. Default: "replace", that of the probe. */
  native?: NativeEstimation;
}

/** The connection that serves light to sessions. */
export interface LightEstimation {
  readonly probe: Probe;
  /** T_space_probe of all sessions; can be replaced at any time. */
  pose: Pose;
  /** Why no reflection cube map can be computed; empty if there is no reason. */
  readonly reflectionError: string;
  /** No session is granted the feature any more, those that have it get no light, and the connection is closed. */
  end(): void;
}

function check(good: boolean, what: string): void {
  if (!good) throw new TypeError(`provideLightEstimation: ${what}`);
}

function unitPose({ rotation, translation }: Pose): Pose {
  const numbers = [...rotation, ...translation];
  const length = Math.hypot(...rotation);
  check(rotation.length === 4 && translation.length === 3 && numbers.every(Number.isFinite) &&
    Math.abs(length - 1) < 1e-3, "pose is a position of three numbers and a quaternion x, y, z, w of length 1");
  return { rotation: rotation.map((v) => v / length) as Pose["rotation"], translation: [...translation] };
}

/** As WebXR's functions fail. */
function asDomException(error: unknown): unknown {
  if (!(error instanceof ProbeError)) return error;
  const name = error.code === "invalid_argument" ? "SyntaxError"
    : error.code === "failed_precondition" ? "NotAllowedError" : "NetworkError";
  return failure(name, error.message);
}

declare const setTimeout: (callback: () => void, ms: number) => unknown;

/** Until the first message of the probe. Rejects if that cannot be decoded: the probe's wire format is newer. */
async function firstDescriptor(probe: Probe, limitMs: number): Promise<void> {
  for (let waited = 0; waited < limitMs; waited += 20) {
    const { received, undecodable, lastError } = probe.stats();
    if (received > 0) return;
    if (undecodable > 0)
      throw failure("NotSupportedError", `the probe's messages cannot be decoded by this version of lightwell ` +
        `(${lastError}): update the package`);
    await new Promise<void>((resume) => setTimeout(resume, 20));
  }
}

const identity: Pose = { rotation: [0, 0, 0, 1], translation: [0, 0, 0] };

/** Connects to the probe at `address` (`wss://HOST:PORT`) and from then on gives its light to the sessions of
 *  navigator.xr that request the feature "light-estimation". An emulator of WebXR must be installed before.
 *  Rejects with DOMException: SyntaxError for an address, NetworkError if the probe does not respond within
 *  connectTimeoutMs, NotAllowedError if it refuses this client, NotSupportedError without WebXR or if its messages
 *  cannot be decoded, InvalidStateError if another probe gives its light already; with TypeError for another option. */
export async function provideLightEstimation(address: string,
                                             options: LightEstimationOptions = {}): Promise<LightEstimation> {
  const { space = "local", scale = 1, signs = "positive", detail = "all", reflectionEdge = 16, native = "replace" } =
    options;
  check(typeof space === "string" || typeof space === "function", "space is a type of reference space or a function");
  check(scale >= 1e-9 && scale <= 1e9, "scale is 1e-9 to 1e9");
  check(signs === "positive" || signs === "condon_shortley", "signs is 'positive' or 'condon_shortley'");
  check(detail === "all" || detail === "harmonics", "detail is 'all' or 'harmonics'");
  check([8, 16, 32, 64].includes(reflectionEdge), "reflectionEdge is 8, 16, 32 or 64");
  check(native === "replace" || native === "prefer", "native is 'replace' or 'prefer'");
  let pose = options.pose === undefined ? null : unitPose(options.pose);
  webXr();
  let probe: Probe;
  try {
    probe = await connect(address, options);
  } catch (error) {
    throw asDomException(error);
  }
  let reflectionError = "";
  let mounting = identity;
  const takeMounting = () => (mounting = probe.info()?.mounting ?? identity);
  takeMounting();
  probe.on("info", takeMounting);
  const session: SessionOptions = {
    probe, space, scale, signs, detail, reflectionEdge,
    pose: () => pose ?? mounting,
    reflectionFailed: (why) => (reflectionError = why),
  };
  try {
    await firstDescriptor(probe, options.connectTimeoutMs ?? 2000);
    const uninstall = installProvider(session, native);
    return {
      probe,
      get pose() {
        return session.pose();
      },
      set pose(value: Pose) {
        pose = unitPose(value);
      },
      get reflectionError() {
        return reflectionError;
      },
      end() {
        uninstall();
        probe.close();
      },
    };
  } catch (error) {
    probe.close();
    throw error;
  }
}
