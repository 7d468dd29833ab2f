// A connection to one probe by WebSocket: firmware/link/web/README.md.
import { Backoff } from "./backoff.js";
import { ClockMap } from "./clock_map.js";
import { EstimatorState, EstimatorUpdate } from "./estimator_config.js";
import { Lighting } from "./lighting.js";
import { LinkCommand, LinkResponse, ProbeError, decodeLinkResponse, encodeLinkRequest } from "./link_message.js";
import {
  Timer, WebSocketConstructor, WebSocketLike, hostNowNs, hostResolutionNs, platformWebSocket,
} from "./platform.js";
import { ProbeCalibration, ProbeStatus, RecordingStatus, printable } from "./probe_status.js";
import { Arrival, DescriptorReceiver, LinkState, LinkStats } from "./receiver.js";
import type { Vec3 } from "./vector.js";
import { DecodeError } from "./wire.js";

/** Default port of a ws:// or wss:// address. */
export const defaultWebPort = 7443;

export interface ProbeOptions {
  /** Identifies the client to a probe with access control. Sent as the first message, over TLS or to this machine. */
  token?: string;
  /** Older answers of latest() are stale, ms. Default: 250. */
  maxAgeMs?: number;
  /** Limit of connect(), of each later connection attempt and of each request, ms. Default: 2000. */
  connectTimeoutMs?: number;
  /** First and longest pause between connection attempts, ms; pauses double, with 20 % jitter. Default: 100, 500. */
  retryMinMs?: number;
  retryMaxMs?: number;
  /** The connection is made again if nothing arrives from the probe for this long, ms. Default: 4000. */
  silenceLimitMs?: number;
  /** The WebSocket to use. Default: the platform's. Node before version 22 has none: pass that of the package `ws`. */
  WebSocket?: WebSocketConstructor;
}

/** Properties of a probe and of its clock. */
export interface ProbeInfo extends ProbeStatus {
  /** The probe's clock minus the host's (performance.now()), ns; the error is at most `clockUncertaintyNs`, which
   *  includes the resolution of the host's clock. */
  clockOffsetNs: bigint;
  clockUncertaintyNs: bigint;
  /** Drift of the probe's clock against the host's, ppm; limited to +-100. */
  clockDriftPpm: number;
}

export interface ProbeEvents {
  /** Every valid descriptor, before latest() is called the next time. */
  descriptor: Arrival;
  /** After each response of the probe to Info, about once a second. */
  info: ProbeInfo;
  state: LinkState;
  /** The probe refuses this client: no token, a wrong or an expired one. Attempts go on, one in five seconds. */
  refused: ProbeError;
}

/** As kInfoPeriod, kFirstInfoPeriod and kFirstRoundTrips of host_sdk/src/core/source.hpp. */
const infoPeriodMs = 1000;
const firstInfoPeriodMs = 20;
const firstRoundTrips = 8;
const subprotocol = "lightwell.v1";
const policyViolation = 1008;
const refusedPauseMs = 5000;
const responseTag = 0x0d;

/** The URL of the probe's descriptors. Throws ProbeError with code invalid_argument. */
function urlOf(address: string, token: string | undefined): string {
  const refused = (why: string) =>
    new ProbeError("invalid_argument", `'${printable(address)}' is not a valid address of a probe: ${why}`);
  const parts = /^(wss?):\/\/(\[[\da-f:.]+\]|[^/?#@:\s[\]]+)(?::(\d{1,5}))?\/?$/i.exec(address);
  if (parts === null) throw refused("write wss://HOST or wss://HOST:PORT (ws:// without TLS)");
  const [, scheme, host] = parts;
  const port = Number(parts[3] ?? defaultWebPort);
  if (port < 1 || port > 65535) throw refused("the port must be a number from 1 to 65535");
  const local = /^(localhost|127(\.\d+){3}|\[::1\])$/i.test(host);
  if (token !== undefined && scheme.toLowerCase() === "ws" && !local)
    throw refused("a token is sent only over TLS, because anyone on the network could read it; write wss://");
  return `${scheme.toLowerCase()}://${host}:${port}/v1/descriptors`;
}

interface PendingRequest {
  resolve(response: LinkResponse): void;
  reject(error: ProbeError): void;
  timer: Timer;
}

/** One WebSocket, from its creation to its end. */
interface Session {
  socket: WebSocketLike;
  opened: boolean;
  lastReceivedNs: bigint;
  roundTrips: number;
}

/** A connection to one probe, with the newest descriptor. It reconnects by itself until close(). */
export class Probe {
  private readonly url: string;
  private readonly makeSocket: WebSocketConstructor;
  private readonly options: Required<Omit<ProbeOptions, "token" | "WebSocket">> & { token?: string };
  private readonly backoff: Backoff;
  private readonly receiver = new DescriptorReceiver();
  private readonly clock = new ClockMap();
  private readonly listeners: { [Name in keyof ProbeEvents]: Set<(event: ProbeEvents[Name]) => void> } = {
    descriptor: new Set(), info: new Set(), state: new Set(), refused: new Set(),
  };
  private readonly pending = new Map<number, PendingRequest>();
  private readonly attempt = new Timer();
  private readonly silence = new Timer();
  private readonly infoDue = new Timer();
  private session: Session | null = null;
  private status: ProbeStatus | null = null;
  private nextId = 1;

  /** For connect(). */
  constructor(address: string, options: ProbeOptions) {
    this.url = urlOf(address, options.token);
    const found = options.WebSocket ?? platformWebSocket();
    if (found === null)
      throw new ProbeError("failed_precondition", "this platform has no WebSocket: pass that of the package `ws` as " +
        "option WebSocket, or run node --experimental-websocket");
    this.makeSocket = found;
    this.options = {
      token: options.token,
      maxAgeMs: options.maxAgeMs ?? 250,
      connectTimeoutMs: options.connectTimeoutMs ?? 2000,
      retryMinMs: options.retryMinMs ?? 100,
      retryMaxMs: options.retryMaxMs ?? 500,
      silenceLimitMs: options.silenceLimitMs ?? 4000,
    };
    for (const [name, value] of Object.entries(this.options))
      if (typeof value === "number" && !(value > 0 && value < 2 ** 31))
        throw new ProbeError("invalid_argument", `${name} must be positive, in milliseconds`);
    this.backoff = new Backoff(this.options.retryMinMs, this.options.retryMaxMs);
    hostResolutionNs();
    this.open();
  }

  /** The newest light. Cheap; validity "none" before the first descriptor, "stale" when none arrives. */
  latest(): Lighting {
    return this.receiver.latest(hostNowNs(), this.options.maxAgeMs);
  }

  /** null before the probe has responded. */
  info(): ProbeInfo | null {
    if (this.status === null) return null;
    const now = hostNowNs();
    return {
      ...this.status,
      clockOffsetNs: this.clock.offset(now),
      clockUncertaintyNs: this.clock.uncertainty(now),
      clockDriftPpm: 1e6 * this.clock.drift,
    };
  }

  stats(): LinkStats {
    return { ...this.receiver.stats };
  }

  /** Calls the listener for each event from now on; the returned function ends that. A listener must not throw. */
  on<Name extends keyof ProbeEvents>(name: Name, listener: (event: ProbeEvents[Name]) => void): () => void {
    this.listeners[name].add(listener);
    return () => this.listeners[name].delete(listener);
  }

  /** The probe's active estimator and its configuration: its file with the changes of all clients. This and the
   *  requests below reject with a ProbeError: the probe's, or unavailable without a connection or a response. */
  async estimator(): Promise<EstimatorState> {
    const { estimator } = await this.request({ ask: "get_config" });
    return estimator ?? this.unexpected();
  }

  /** Sets the fields that are present, for all clients of the probe: changeEstimator({ panorama: { epsilon: 0.02 } }).
   *  Takes effect with the probe's next capture. Resolves with the configuration after the change. */
  async changeEstimator(update: EstimatorUpdate): Promise<EstimatorState> {
    const { estimator } = await this.request({ ask: "set_config", update });
    return estimator ?? this.unexpected();
  }

  /** Reports the reading (lux) of a lux meter beside the probe that faces `normal` (probe frame): from then on its
   *  units are absolute. Resolves with the factor that was applied to radiance. */
  async reportLux(lux: number, normal: Vec3): Promise<number> {
    const { scale } = await this.request({ ask: "report_lux", lux, normal });
    return scale ?? this.unexpected();
  }

  /** What the probe's calibration covers, and how well. It does not change while the probe runs. */
  async calibration(): Promise<ProbeCalibration> {
    const { calibration } = await this.request({ ask: "get_calibration" });
    return calibration ?? this.unexpected();
  }

  /** Starts a recording of all descriptors by the probe, in the folder that its owner has configured (`recordings`);
   *  the file stays there. Rejects with failed_precondition if there is no folder, or a recording runs already, and
   *  with resource_exhausted at a limit of the folder or of the disk. Resolves with the state after it. */
  async startRecording(): Promise<RecordingStatus> {
    return this.controlRecording("start");
  }

  /** Ends it. Rejects with failed_precondition if none runs. */
  async stopRecording(): Promise<RecordingStatus> {
    return this.controlRecording("stop");
  }

  /** Ends the connection. latest() keeps the last light, with its growing age. */
  close(): void {
    if (this.receiver.stats.state === "closed") return;
    this.drop();
    this.setState("closed");
  }

  private async controlRecording(action: "start" | "stop"): Promise<RecordingStatus> {
    const { recording } = await this.request({ ask: "control_recording", action });
    return recording ?? this.unexpected();
  }

  private unexpected(): never {
    throw new ProbeError("internal", "the probe's response does not match the request");
  }

  private emit<Name extends keyof ProbeEvents>(name: Name, event: ProbeEvents[Name]): void {
    for (const listener of [...this.listeners[name]]) listener(event);
  }

  private setState(state: LinkState): void {
    if (this.receiver.stats.state === state) return;
    this.receiver.setState(state);
    this.emit("state", state);
  }

  private open(): void {
    this.setState("connecting");
    let socket: WebSocketLike;
    try {
      socket = new this.makeSocket(this.url, [subprotocol]);
    } catch (cause) {
      // For example a page of https that may not connect to ws.
      return this.lost(`no connection: ${cause instanceof Error ? cause.message : cause}`);
    }
    const session: Session = { socket, opened: false, lastReceivedNs: hostNowNs(), roundTrips: 0 };
    this.session = session;
    const current = (handler: (event: never) => void) => (event: never) => {
      if (this.session === session) handler(event);
    };
    socket.binaryType = "arraybuffer";
    socket.onopen = current(() => this.onOpen(session));
    socket.onmessage = current(({ data }: { data: unknown }) => this.onMessage(session, data));
    // The event names no reason; a closing event follows.
    socket.onerror = () => {};
    socket.onclose = current(({ code, reason }: { code: number; reason: string }) => {
      if (code === policyViolation && session.roundTrips === 0) return this.refused(reason);
      const why = session.opened ? `the connection ended (${code}${reason ? `, ${reason}` : ""})` :
        "no connection: the probe is not reachable, refuses this page, or has a certificate that is not trusted";
      this.lost(why);
    });
    this.attempt.start(this.options.connectTimeoutMs, () => this.lost("no answer within connectTimeoutMs"));
  }

  private onOpen(session: Session): void {
    session.opened = true;
    session.lastReceivedNs = hostNowNs();
    this.watchSilence(session);
    const { token } = this.options;
    if (token === undefined) return this.askInfo(session);
    this.send(session, { ask: "authenticate", token }).then(() => this.askInfo(session), (error: ProbeError) => {
      if (this.session === session) this.refused(error.message);
    });
  }

  private watchSilence(session: Session): void {
    const limit = this.options.silenceLimitMs;
    const silent = Number(hostNowNs() - session.lastReceivedNs) / 1e6;
    if (silent >= limit) return this.lost("no data from the probe within silenceLimitMs");
    this.silence.start(limit - silent + 1, () => this.watchSilence(session));
  }

  private askInfo(session: Session): void {
    if (this.session !== session) return;
    const sent = hostNowNs();
    this.send(session, { ask: "info" }).then((response) => {
      if (this.session === session) this.onInfo(session, response, sent);
    }, (error: ProbeError) => {
      if (this.session !== session) return;
      this.receiver.report(error.message);
      this.infoDue.start(infoPeriodMs, () => this.askInfo(session));
    });
  }

  private onInfo(session: Session, { info }: LinkResponse, sentNs: bigint): void {
    const period = ++session.roundTrips < firstRoundTrips ? firstInfoPeriodMs : infoPeriodMs;
    this.infoDue.start(period, () => this.askInfo(session));
    if (!info) return this.receiver.report("the probe's response does not match the request");
    const resolution = hostResolutionNs();
    // When the message arrived: the promise that leads here resolves later, but in the same task.
    this.clock.add(sentNs - resolution, info.clockNowNs, session.lastReceivedNs + resolution);
    this.status = info.status;
    this.attempt.stop();
    this.backoff.reset();
    this.setState("connected");
    this.emit("info", this.info()!);
  }

  private onMessage(session: Session, data: unknown): void {
    const now = (session.lastReceivedNs = hostNowNs());
    if (!(data instanceof ArrayBuffer)) return this.receiver.refuse("a message that is text; a probe sends none");
    const bytes = new Uint8Array(data);
    if (bytes[0] === responseTag) return this.onResponse(bytes);
    // A probe responds before it sends descriptors, so only the first ones can arrive while the clock is unknown.
    if (!this.clock.known) return;
    const arrival = this.receiver.receive(bytes, now, this.clock);
    if (arrival) this.emit("descriptor", arrival);
  }

  private onResponse(bytes: Uint8Array): void {
    let response: LinkResponse;
    try {
      response = decodeLinkResponse(bytes);
    } catch (cause) {
      if (!(cause instanceof DecodeError)) throw cause;
      return this.receiver.refuse(cause.message);
    }
    const request = this.pending.get(response.id);
    if (!request) {
      // One that came after its time is no fault of the probe's.
      if (response.id >= this.nextId) this.receiver.refuse("a response to no request");
      return;
    }
    this.pending.delete(response.id);
    request.timer.stop();
    if (response.error) request.reject(response.error);
    else request.resolve(response);
  }

  private request(command: LinkCommand): Promise<LinkResponse> {
    const session = this.session;
    if (session === null || this.receiver.stats.state !== "connected")
      return Promise.reject(new ProbeError("unavailable", "not connected"));
    return this.send(session, command);
  }

  private send({ socket }: Session, command: LinkCommand): Promise<LinkResponse> {
    return new Promise((resolve, reject) => {
      // 0 is not on the wire, and the other side tells responses by that field.
      const id = this.nextId;
      this.nextId = id === 0xffffffff ? 1 : id + 1;
      try {
        socket.send(encodeLinkRequest(id, command));
      } catch (cause) {
        const code = cause instanceof TypeError ? "invalid_argument" : "unavailable";
        return reject(new ProbeError(code, cause instanceof Error ? cause.message : String(cause)));
      }
      const timer = new Timer();
      this.pending.set(id, { resolve, reject, timer });
      timer.start(this.options.connectTimeoutMs, () => {
        this.pending.delete(id);
        reject(new ProbeError("unavailable", "the probe did not respond in time"));
      });
    });
  }

  /** Ends the session. All pending requests fail. */
  private drop(): void {
    const session = this.session;
    this.session = null;
    for (const timer of [this.attempt, this.silence, this.infoDue]) timer.stop();
    session?.socket.close();
    const requests = [...this.pending.values()];
    this.pending.clear();
    for (const { reject, timer } of requests) {
      timer.stop();
      reject(new ProbeError("unavailable", "the connection was lost before the probe responded"));
    }
  }

  private refused(why: string): void {
    const error = new ProbeError("failed_precondition", `the probe refused this client: ${printable(why) ||
      (this.options.token === undefined ? "it needs a token" : "its token is wrong or expired")}`);
    this.lost(error.message, refusedPauseMs);
    this.emit("refused", error);
  }

  private lost(why: string, pauseMs = this.backoff.next()): void {
    if (this.receiver.stats.state === "closed") return;
    this.drop();
    this.receiver.report(why);
    this.setState("waiting");
    this.attempt.start(pauseMs, () => this.open());
  }
}

/** Connects to a probe: `wss://HOST:PORT` (TLS) or `ws://HOST:PORT`; default port 7443. Rejects with a ProbeError:
 *  invalid_argument for an address or option, unavailable if the probe does not respond within connectTimeoutMs,
 *  failed_precondition if it refuses this client, or without a WebSocket. */
export function connect(address: string, options: ProbeOptions = {}): Promise<Probe> {
  return new Promise((resolve, reject) => {
    const probe = new Probe(address, options);
    const limit = new Timer();
    const settled = () => {
      limit.stop();
      ends.forEach((end) => end());
    };
    const fail = (error: ProbeError) => {
      settled();
      probe.close();
      reject(error);
    };
    const ends = [
      probe.on("info", () => {
        settled();
        resolve(probe);
      }),
      probe.on("refused", fail),
    ];
    const timeout = options.connectTimeoutMs ?? 2000;
    limit.start(timeout, () => {
      const { lastError } = probe.stats();
      fail(new ProbeError("unavailable", `no answer within ${timeout} ms${lastError ? ` (${lastError})` : ""}`));
    });
  });
}
