// A probe's WebSocket link for tests: protocol of firmware/link/web/README.md, messages made and read by protoc, so
// that the module's own codec is not its own judge. Environment: LIGHTWELL_PROTOC, LIGHTWELL_PROTO (the folder proto),
// LIGHTWELL_NODE_WS (the folder of the package ws).
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

export const { WebSocket, WebSocketServer } = createRequire(import.meta.url)(process.env.LIGHTWELL_NODE_WS);

const { LIGHTWELL_PROTOC: protoc, LIGHTWELL_PROTO: proto } = process.env;
const files = ["link_message", "descriptor", "captured_plane"].map((name) => `lightwell/v1/${name}.proto`);
const run = (how, type, input) => execFileSync(protoc, [`-I${proto}`, `--${how}=lightwell.v1.${type}`, ...files],
  { input, stdio: ["pipe", "pipe", "ignore"] });

/** Bytes of the message with this content in protobuf's text format. */
export const encode = (type, text) => new Uint8Array(run("encode", type, text));
/** Text of a message, in one line; null if the bytes are none. */
export function decode(type, bytes) {
  try {
    return run("decode", type, bytes).toString().trim().replace(/\s+/g, " ");
  } catch {
    return null;
  }
}

export const vector = (name) => new Uint8Array(readFileSync(`${proto}/vectors/${name}.bin`));

const descriptorText = decode("LightingDescriptor", vector("v1_lamp_at_plus_x"));
/** A descriptor with this sequence number and time. */
export const descriptor = (sequence, midExposureNs = 1_000_000n * BigInt(sequence)) =>
  encode("LightingDescriptor", descriptorText.replace(/sequence: \d+/, `sequence: ${sequence}`)
    .replace(/mid_exposure_ns: \d+/, `mid_exposure_ns: ${midExposureNs}`));

const config = "kind: ESTIMATOR_KIND_PANORAMA estimator { band: 4 max_lights: 3 setting: SETTING_FAST " +
  "panorama { light_threshold: 7 epsilon: 0.02 radiance_epsilon: 0 unseen_fill: UNSEEN_FILL_MIRROR " +
  "smoothing: SMOOTHING_NONE environment_edge: 32 environment_rate: 2 interleave: 4 max_bytes: 128 } " +
  "marker { decimation: 0 search_decimation: 1 max_faces: 0 } specular { environment_edge: 0 } }";
const clockMark = 0x1122334455667788n;
const response = (id, text) => encode("LinkResponse", `id: ${id} ${text}`);
/** A response to Info, in which id and clock are replaced for each request. more: further fields. */
export const infoOf = (name, more = "") => response(0x01020304,
  `info { probe_name: "${name}" probe_id: 5 calibration_id: 6 ` +
  `version: "0.1.0" camera: "fake" clock_now_ns: ${clockMark} counters { frames: 9 clients: 2 estimates_failed: 4 } ` +
  `${more} }`);

/** Replaces a number of fixed width by another. */
function patched(bytes, mark, value, size) {
  const number = Buffer.alloc(8);
  number.writeBigUInt64LE(BigInt(mark));
  const out = Buffer.from(bytes);
  const at = out.indexOf(number.subarray(0, size));
  number.writeBigUInt64LE(BigInt.asUintN(64, BigInt(value)));
  number.copy(out, at, 0, size);
  return out;
}

/** Serves at a free port of the loopback address. Members are to be read and changed by tests. */
export class FakeProbe {
  /** The probe's clock minus performance.now(), ns. */
  clockOffsetNs = 1_234_567_890_123n;
  /** Not null: clients must authenticate with it. */
  token = null;
  /** Text of each request, as protoc decodes it. */
  requests = [];
  clients = new Set();
  connections = 0;
  /** Sent to a client as soon as it is accepted. */
  newest = null;
  /** What is done with requests; null: nothing, the probe is silent. */
  answers = true;

  static async start(port = 0) {
    const probe = new FakeProbe();
    probe.server = new WebSocketServer({ host: "127.0.0.1", port, handleProtocols: (offered) => [...offered][0] });
    await new Promise((listening) => probe.server.once("listening", listening));
    probe.port = probe.server.address().port;
    probe.info = infoOf("attic");
    probe.server.on("connection", (socket, request) => probe.accept(socket, request));
    return probe;
  }

  get address() {
    return `ws://127.0.0.1:${this.port}`;
  }

  accept(socket, request) {
    ++this.connections;
    this.path = request.url;
    this.protocol = socket.protocol;
    let accepted = this.token === null;
    const admit = () => {
      accepted = true;
      this.clients.add(socket);
      if (this.newest) socket.send(this.newest);
    };
    if (accepted) admit();
    socket.on("close", () => this.clients.delete(socket));
    socket.on("error", () => {});
    socket.on("message", (data) => {
      if (!this.answers) return;
      const id = data.readUInt32LE(1);
      // Requests of Info come often, and starting protoc would take longer than their period.
      if (accepted && data[5] === 0x12)
        return socket.send(patched(patched(this.info, 0x01020304, id, 4), clockMark, this.clockNow(), 8));
      const text = decode("LinkRequest", data);
      this.requests.push(text.replace(/^id: \d+ /, ""));
      if (!accepted) {
        if (text !== `id: ${id} authenticate { token: "${this.token}" }`)
          return socket.close(1008, "send a valid token first");
        socket.send(response(id, "authenticate {}"));
        return admit();
      }
      socket.send(this.respond(id, text));
    });
  }

  respond(id, text) {
    if (text.includes("max_lights: 65"))
      return response(id, 'code: LINK_CODE_INVALID_ARGUMENT message: "max_lights must be 0 to 64"');
    if (text.includes("get_config")) return response(id, `get_config { ${config} }`);
    if (text.includes("set_config")) return response(id, `set_config { now { ${config} } }`);
    if (text.includes("report_lux")) return response(id, "report_lux { scale: 2.5 }");
    return response(id, "authenticate {}");
  }

  clockNow() {
    return BigInt(Math.round(performance.now() * 1e6)) + this.clockOffsetNs;
  }

  publish(bytes) {
    for (const client of this.clients) client.send(bytes);
  }

  /** Ends all connections, and refuses new ones. */
  async stop() {
    for (const client of this.server.clients) client.terminate();
    await new Promise((done) => this.server.close(done));
  }
}

/** Waits until the condition holds. Throws after ten seconds. */
export async function until(condition, what) {
  for (const end = performance.now() + 10_000; performance.now() < end;) {
    if (condition()) return;
    await new Promise((resume) => setTimeout(resume, 2));
  }
  throw new Error(`not within ten seconds: ${what}`);
}
