// connect() of the TypeScript module against a probe's WebSocket link.
// usage: node --test connection_test.mjs; environment: LIGHTWELL_MODULE (lightwell.js) and that of fake_probe.mjs
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { afterEach, beforeEach, test } from "node:test";
import { pathToFileURL } from "node:url";

import { FakeProbe, WebSocket, decode, descriptor, until, vector } from "./fake_probe.mjs";

const { connect } = await import(pathToFileURL(process.env.LIGHTWELL_MODULE).href);

let server;
let probe;
beforeEach(async () => {
  server = await FakeProbe.start();
});
afterEach(async () => {
  probe?.close();
  await server.stop();
});
const open = async (options = {}) => (probe = await connect(server.address, { WebSocket, ...options }));
const millisecond = 1_000_000n;
const abs = (v) => (v < 0n ? -v : v);

test("the newest descriptor becomes the light, with its age by the mapped clock", async () => {
  await open();
  assert.deepEqual([server.path, server.protocol], ["/v1/descriptors", "lightwell.v1"]);
  assert.equal(probe.latest().validity, "none");
  server.publish(descriptor(7, server.clockNow() - 20n * millisecond));
  await until(() => probe.latest().descriptor, "a descriptor");
  const light = probe.latest();
  assert.equal(light.descriptor.sequence, 7n);
  assert.equal(light.validity, "valid");
  assert.ok(light.ageMs >= 19.9 && light.ageMs < 200, `age ${light.ageMs}`);
  const { value } = light.irradiance([1, 0, 0]);
  assert.ok(value[0] > 0);
  const { received, bytes, state } = probe.stats();
  assert.deepEqual([received, state], [1, "connected"]);
  assert.ok(bytes > 50);
});

test("the clock's offset is known within its uncertainty", async () => {
  await open();
  await until(() => probe.info().clockUncertaintyNs < 2n * millisecond, "a short round trip");
  const { clockOffsetNs, clockUncertaintyNs, name, counters } = probe.info();
  assert.ok(abs(clockOffsetNs - server.clockOffsetNs) <= clockUncertaintyNs, `${clockOffsetNs}`);
  assert.ok(clockUncertaintyNs > 0n);
  assert.equal(name, "attic");
  assert.deepEqual([counters.frames, counters.clients, counters.estimatesFailed], [9, 2, 4]);
});

test("events tell descriptors, info and states", async () => {
  await open();
  const seen = [];
  const end = probe.on("descriptor", ({ descriptor: d, midExposureNs, receivedNs }) => {
    seen.push(d.sequence);
    assert.ok(midExposureNs < receivedNs + 5n * millisecond);
  });
  const states = [];
  probe.on("state", (state) => states.push(state));
  server.publish(descriptor(1, server.clockNow()));
  server.publish(descriptor(2, server.clockNow()));
  await until(() => seen.length === 2, "two events");
  end();
  server.publish(descriptor(5, server.clockNow()));
  await until(() => probe.stats().received === 3, "a third descriptor");
  assert.deepEqual(seen, [1n, 2n]);
  assert.equal(probe.stats().gaps, 2);
  probe.close();
  assert.deepEqual(states, ["closed"]);
});

test("the example of host_sdk/README.md runs", async () => {
  server.token = "secret";
  server.newest = descriptor(1, server.clockNow());
  const readme = readFileSync(join(process.env.LIGHTWELL_PROTO, "../host_sdk/README.md"), "utf8");
  const [, code] = /```ts\nimport \{ connect \} from "lightwell";\n([^]*?)```/.exec(readme);
  const shaded = [];
  const environment = {
    connect: (address, options) => {
      assert.equal(address, "wss://probe.local");
      return open(options);
    },
    token: "secret",
    shade: (value, errorBound) => shaded.push([value, errorBound]),
    requestAnimationFrame: (callback) => shaded.length < 3 && setTimeout(callback, 5),
  };
  const AsyncFunction = (async () => {}).constructor;
  await new AsyncFunction(...Object.keys(environment), code)(...Object.values(environment));
  server.publish(descriptor(2, server.clockNow()));
  await until(() => shaded.length >= 3, "three frames");
  assert.ok(shaded[0][0][0] > 0 && shaded[0][1] >= 0);
});

test("a token is the first message, and nothing is asked before the probe accepts it", async () => {
  server.token = "secret";
  await open({ token: "secret" });
  assert.deepEqual(server.requests, ['authenticate { token: "secret" }']);
});

test("a refused token or a missing one rejects with the probe's reason", async () => {
  server.token = "secret";
  for (const [options, first] of [[{ token: "wrong" }, 'authenticate { token: "wrong" }'], [{}, "info { }"]]) {
    server.requests = [];
    await assert.rejects(open(options), { code: "failed_precondition", message: /send a valid token first/ });
    assert.deepEqual(server.requests, [first]);
  }
  // The connection is not tried again after connect() has failed.
  const { connections } = server;
  await new Promise((resume) => setTimeout(resume, 300));
  assert.equal(server.connections, connections);
});

test("a token never leaves over plain text to another machine", async () => {
  const sockets = [];
  const Recorder = class {
    constructor(url) {
      sockets.push(url);
    }
    close() {}
  };
  const refused = (address, token) =>
    assert.rejects(connect(address, { token, WebSocket: Recorder, connectTimeoutMs: 20 }));
  await assert.rejects(connect("ws://probe.local", { token: "t", WebSocket: Recorder }), { code: "invalid_argument" });
  assert.deepEqual(sockets, []);
  await refused("wss://probe.local", "t");
  await refused("ws://[::1]:81", "t");
  await refused("ws://probe.local", undefined);
  assert.deepEqual(sockets, ["wss://probe.local:7443/v1/descriptors", "ws://[::1]:81/v1/descriptors",
    "ws://probe.local:7443/v1/descriptors"]);
});

test("an address or option that is none is refused before anything is sent", async () => {
  for (const address of ["", "probe", "http://probe", "wss://", "wss://probe:0", "wss://probe:70000", "wss://probe/x",
                         "wss://user@probe", "wss://probe?x", "wss://pro be", "wss://[::1"])
    await assert.rejects(connect(address, { WebSocket }), { code: "invalid_argument" }, address);
  await assert.rejects(open({ retryMinMs: 0 }), { code: "invalid_argument", message: /retryMinMs/ });
});

test("without a probe it rejects within the limit", async () => {
  await server.stop();
  const begin = performance.now();
  await assert.rejects(open({ connectTimeoutMs: 200 }), { code: "unavailable", message: /200 ms.*not reachable/ });
  assert.ok(performance.now() - begin < 2000);
  server = await FakeProbe.start();
});

test("it reconnects by itself to a probe that was restarted, whose sequence and clock start again", async () => {
  await open();
  server.publish(descriptor(1000, server.clockNow()));
  await until(() => probe.stats().received === 1, "a descriptor");
  const states = [];
  probe.on("state", (state) => states.push(state));
  const { port } = server;
  await server.stop();
  await until(() => probe.stats().state === "waiting", "the loss");
  await until(() => probe.latest().validity === "stale", "staleness");
  assert.equal(probe.latest().descriptor.sequence, 1000n);
  server = await FakeProbe.start(port);
  server.clockOffsetNs = 5n * millisecond;
  await until(() => probe.stats().reconnects === 1 && server.clients.size === 1, "the reconnection");
  await until(() => abs(probe.info().clockOffsetNs - server.clockOffsetNs) < 5n * millisecond, "the new clock");
  server.publish(descriptor(1, server.clockNow()));
  await until(() => probe.latest().descriptor.sequence === 1n, "the descriptor after the restart");
  assert.equal(probe.latest().validity, "valid");
  assert.equal(probe.stats().gaps, 0);
  assert.deepEqual([states[0], states.at(-1)], ["waiting", "connected"]);
});

test("pauses start again at the shortest after a success", async () => {
  let attempts = 0;
  const Counting = class extends WebSocket {
    constructor(...address) {
      super(...address);
      ++attempts;
    }
  };
  await open({ WebSocket: Counting, retryMinMs: 20, retryMaxMs: 5000 });
  const { port } = server;
  await server.stop();
  // After 20, 40, 80, 160 and 320 ms, each +-20 %.
  await until(() => attempts === 6, "five further attempts");
  server = await FakeProbe.start(port);
  await until(() => probe.stats().reconnects === 1, "the reconnection");
  const before = attempts;
  const begin = performance.now();
  await server.stop();
  await until(() => attempts === before + 2, "two further attempts");
  assert.ok(performance.now() - begin < 500, "60 ms, not a second");
  server = await FakeProbe.start();
});

test("a probe that falls silent is given up and asked again", async () => {
  await open({ silenceLimitMs: 100 });
  server.answers = false;
  await until(() => server.connections >= 3, "further attempts");
  server.answers = true;
  await until(() => probe.stats().reconnects >= 1, "the reconnection");
  assert.match(probe.stats().lastError, /./);
});

test("a repeated or older descriptor is dropped, and the newest kept", async () => {
  await open();
  const newest = descriptor(9, server.clockNow());
  server.publish(newest);
  server.publish(newest);
  server.publish(descriptor(8, server.clockNow() - 100n * millisecond));
  await until(() => probe.stats().replayed === 2, "two dropped");
  assert.deepEqual([probe.latest().descriptor.sequence, probe.stats().received], [9n, 1]);
});

test("hostile messages are counted, and the last valid descriptor and the connection stay", async () => {
  await open();
  server.publish(descriptor(1, server.clockNow()));
  await until(() => probe.stats().received === 1, "a descriptor");
  const cut = descriptor(2, server.clockNow()).subarray(0, -1);
  const wrong = [
    "text", new Uint8Array(0), Uint8Array.from([0x99]), cut, Uint8Array.from([0x0d]),
    Uint8Array.from([0x0d, 1, 2, 3, 4]), Uint8Array.from([0x0d, 1, 2, 3, 4, 0x1a, 1, 0xff]),
    new Uint8Array(8193).fill(0x0d), vector("v1_smallest").map(() => 8),
  ];
  for (const message of wrong) server.publish(message);
  await until(() => probe.stats().undecodable === wrong.length, `${wrong.length} refused`);
  server.publish(new Uint8Array(65537).fill(8));
  await until(() => probe.stats().oversized === 1, "the oversized one");
  assert.match(probe.stats().lastError, /65537/);
  assert.equal(probe.latest().descriptor.sequence, 1n);
  server.publish(descriptor(3, server.clockNow()));
  await until(() => probe.latest().descriptor.sequence === 3n, "the next valid one");
  assert.equal(server.connections, 1);
});

test("environment maps are kept for later descriptors, and changes without their map are counted", async () => {
  await open();
  server.publish(vector("v1_environment_changes"));
  await until(() => probe.stats().mapsWithoutKey === 1, "changes without a map");
  assert.equal(probe.latest().environment, null);
  const whole = vector("v1_fullest");
  server.publish(whole);
  await until(() => probe.stats().received === 2, "the fullest descriptor");
  assert.match(decode("LightingDescriptor", whole), /environment \{.*levels/);
  assert.ok(probe.latest().environment.levels.length > 0);
});

test("the configuration is read and changed, and the probe's error comes back", async () => {
  await open();
  const state = await probe.estimator();
  assert.equal(state.kind, "panorama");
  assert.deepEqual(state.config, {
    band: 4, maxLights: 3, setting: "fast",
    panorama: { lightThreshold: 7, epsilon: 0.02, radianceEpsilon: 0, unseenFill: "mirror", smoothing: "none",
                environmentEdge: 32, environmentRate: 2, interleave: 4, maxBytes: 128 },
    marker: { decimation: 0, searchDecimation: 1, maxFaces: 0 }, specular: { environmentEdge: 0 },
  });
  const update = { setting: "exact", panorama: { epsilon: 0.05, unseenFill: "average" }, marker: { maxFaces: 300 } };
  assert.deepEqual(await probe.changeEstimator(update), state);
  assert.equal(server.requests.at(-1), "set_config { config { estimator { setting: SETTING_EXACT " +
    "panorama { epsilon: 0.05 unseen_fill: UNSEEN_FILL_AVERAGE } marker { max_faces: 300 } } } }");
  await probe.changeEstimator({ setting: "fastest" });
  assert.equal(server.requests.at(-1), "set_config { config { estimator { setting: SETTING_FASTEST } } }");
  await assert.rejects(probe.changeEstimator({ maxLights: 65 }), { code: "invalid_argument", message: /0 to 64/ });
  assert.equal(await probe.reportLux(420, [0, 1, -0.5]), 2.5);
  assert.equal(server.requests.at(-1), "report_lux { lux: 420 normal_y: 1 normal_z: -0.5 }");
});

test("an update that is none is refused without asking the probe", async () => {
  await open();
  for (const update of [{}, { panorama: {} }, { bandwidth: 3 }, { panorama: { edge: 8 } }, { setting: "best" },
                        { band: -1 }, { band: 1.5 }, { band: "6" }, { panorama: { smoothing: 1 } }])
    await assert.rejects(probe.changeEstimator(update), { code: "invalid_argument" }, JSON.stringify(update));
  assert.deepEqual(server.requests, []);
});

test("requests fail where there is no connection, and where the probe does not respond", async () => {
  await open({ connectTimeoutMs: 300 });
  server.answers = false;
  await assert.rejects(probe.estimator(), { code: "unavailable", message: /in time/ });
  const asked = assert.rejects(probe.estimator(), { code: "unavailable", message: /was lost/ });
  await server.stop();
  await asked;
  await assert.rejects(probe.estimator(), { code: "unavailable" });
  server = await FakeProbe.start();
});
