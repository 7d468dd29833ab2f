// The parts of the TypeScript module's connection without a network: clock map, back-off, responses.
// usage: as connection_test.mjs
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

import { decode, encode } from "./fake_probe.mjs";

const dist = dirname(process.env.LIGHTWELL_MODULE);
const module = (name) => import(pathToFileURL(join(dist, `${name}.js`)).href);
const { ClockMap } = await module("clock_map");
const { Backoff } = await module("backoff");
const { decodeLinkResponse, encodeLinkRequest } = await module("link_message");
const { DecodeError } = await module("wire");

const ms = 1_000_000n;
const second = 1000n * ms;
const abs = (v) => (v < 0n ? -v : v);

/** Uniform, 0 to 1 (Park & Miller 1988). */
function generator(seed) {
  let state = seed;
  return () => (state = (state * 48271) % 2147483647) / 2147483647;
}

function ask(map, offset, sent, there, back) {
  map.add(sent, sent + there + offset, sent + there + back);
}

test("clock map: symmetric delays give the offset exactly", () => {
  for (const offset of [0n, 123n * second, -7n * second]) {
    const map = new ClockMap();
    assert.equal(map.known, false);
    ask(map, offset, 1000n * second, 2n * ms, 2n * ms);
    assert.ok(abs(map.offset(1000n * second) - offset) <= 2n);
    assert.ok(abs(map.uncertainty(1000n * second + 4n * ms) - 2n * ms) <= 4n);
    assert.ok(abs(map.toHost(500n * second + offset) - 500n * second) <= 2n);
  }
});

test("clock map: the truth is always within the uncertainty, and the drift becomes known", () => {
  for (const ppm of [-95, 0, 80]) {
    const random = generator(1 + Math.abs(ppm));
    const map = new ClockMap();
    const truth = (host) => 7n * second + BigInt(Math.round(1e-6 * ppm * Number(host)));
    for (let i = 0; i <= 300; ++i) {
      const sent = second * BigInt(i);
      const there = 100_000n + BigInt(Math.round(-Math.log(1 - random()) * 5e5));
      const back = 100_000n + BigInt(Math.round(-Math.log(1 - random()) * 5e5));
      ask(map, truth(sent + there), sent, there, back);
      const now = sent + there + back;
      assert.ok(abs(map.offset(now) - truth(now)) <= map.uncertainty(now), `${ppm} ppm, ${i} s`);
    }
    assert.ok(Math.abs(1e6 * map.drift - ppm) < 8, `${1e6 * map.drift} ppm for ${ppm}`);
    const later = 360n * second;
    assert.ok(abs(map.offset(later) - truth(later)) <= map.uncertainty(later));
    assert.ok(map.uncertainty(later) < 2n * ms);
  }
});

test("clock map: a reset is followed at once, and nonsense is ignored", () => {
  const map = new ClockMap();
  ask(map, 100n * second, 10n * second, ms, ms);
  map.add(11n * second, 1n << 62n, 11n * second + ms);
  map.add(11n * second, 0n, 9n * second);
  assert.ok(abs(map.offset(10n * second) - 100n * second) <= 2n);
  ask(map, -3n * second, 11n * second, 5n * ms, 5n * ms);
  assert.ok(abs(map.offset(11n * second + 10n * ms) + 3n * second) <= 2n);
});

test("pauses double up to the longest, each within 20 %, and start again after a success", () => {
  for (const random of [0, 0.5, 1]) {
    const backoff = new Backoff(100, 500, () => random);
    const factor = 0.8 + 0.4 * random;
    const expected = [100, 200, 400, 500, 500].map((v) => v * factor);
    expected.forEach((v) => assert.ok(Math.abs(backoff.next() - v) < 1e-9));
    backoff.reset();
    assert.ok(Math.abs(backoff.next() - 100 * factor) < 1e-9);
  }
});

const whole = encode("LinkResponse", 'id: 77 info { probe_name: "Küche" probe_id: 1 version: "v" camera: "c" ' +
  "clock_now_ns: 123456789012 counters { frames: 300 clients: 1 client_list_faults: 70000 } }");

test("responses: values of a message that protoc wrote", () => {
  const { id, error, info } = decodeLinkResponse(whole);
  assert.deepEqual([id, error, info.clockNowNs, info.status.name], [77, null, 123456789012n, "Küche"]);
  assert.deepEqual([info.status.counters.frames, info.status.counters.clientListFaults], [300, 70000]);
  const failed =
    decodeLinkResponse(encode("LinkResponse", 'id: 1 code: LINK_CODE_RESOURCE_EXHAUSTED message: "a\\nb"'));
  assert.deepEqual([failed.error.code, failed.error.message], ["resource_exhausted", "a?b"]);
  assert.equal(decodeLinkResponse(encode("LinkResponse", "id: 1 code: 99")).error.code, "internal");
});

/** Numbers of the fields of a message by name, deprecated ones left out, read from the .proto file. */
function fieldsOf(file, message) {
  const text = readFileSync(join(process.env.LIGHTWELL_PROTO, `lightwell/v1/${file}.proto`), "utf8");
  const [, body] = new RegExp(`^message ${message} \\{\n([^]*?)^\\}`, "m").exec(text);
  return Object.fromEntries([...body.matchAll(/^ {2}(?:optional )?\w+ (\w+) = (\d+);/gm)]
    .map(([, name, number]) => [name, Number(number)]));
}
const snake = (name) => name.replace(/[A-Z]/g, (letter) => `_${letter.toLowerCase()}`);

test("every counter and every option of the messages is known", () => {
  const counters = fieldsOf("probe_service", "Counters");
  const values = Object.entries(counters).map(([name, number]) => `${name}: ${number}`).join(" ");
  const { info } = decodeLinkResponse(encode("LinkResponse", `id: 1 info { counters { ${values} } }`));
  assert.deepEqual(Object.fromEntries(Object.entries(info.status.counters).map(([k, v]) => [snake(k), v])), counters);
  const { estimator: { config } } =
    decodeLinkResponse(encode("LinkResponse", "id: 1 get_config { kind: ESTIMATOR_KIND_PANORAMA }"));
  const names = (part) => Object.keys(part).map(snake).sort();
  assert.deepEqual(names(config), Object.keys(fieldsOf("config", "EstimatorConfig")).sort());
  for (const [section, message] of [["panorama", "Panorama"], ["marker", "Marker"], ["specular", "Specular"]])
    assert.deepEqual(names(config[section]), Object.keys(fieldsOf("config", `${message}EstimatorConfig`)).sort());
});

const recordingOf = (fields) =>
  `${fields} file: "a\\nb.lwr" bytes: 5000000000 descriptors: 2 lost: 3 end_reason: "full" faults: 4`;

test("the recording of a probe: in its status and after a start or a stop", () => {
  const expected =
    { running: true, file: "a?b.lwr", bytes: 5e9, descriptors: 2, lost: 3, endReason: "full", faults: 4 };
  const of = (text) => decodeLinkResponse(encode("LinkResponse", `id: 1 ${text}`));
  assert.deepEqual(of(`info { recording { ${recordingOf("running: true")} } }`).info.status.recording, expected);
  assert.equal(of("info {}").info.status.recording, null);
  assert.deepEqual(of(`control_recording { recording { ${recordingOf("running: true")} } }`).recording, expected);
  assert.equal(of("control_recording {}").recording.running, false);
  assert.equal(of("info {}").recording, undefined);
  assert.match(decode("LinkRequest", encodeLinkRequest(7, { ask: "control_recording", action: "start" })),
               /id: 7[^]*control_recording[^]*RECORDING_ACTION_START/);
  assert.match(decode("LinkRequest", encodeLinkRequest(7, { ask: "control_recording", action: "stop" })),
               /RECORDING_ACTION_STOP/);
  // Of alternatives the last one counts.
  const both = Buffer.concat([encode("LinkResponse", `id: 1 control_recording { recording { ${recordingOf("")} } }`),
                              encode("LinkResponse", "report_lux { scale: 2 }")]);
  assert.deepEqual([decodeLinkResponse(both).recording, decodeLinkResponse(both).scale], [undefined, 2]);
});

test("the mounting of a probe; an invalid one is dropped", () => {
  const of = (text) => decodeLinkResponse(encode("LinkResponse", `id: 1 info { ${text} }`)).info.status.mounting;
  assert.deepEqual(of("mounting { pose { qy: 2 tx: 1 ty: 2 tz: 3 } covariance: 1 }"),
                   { rotation: [0, 1, 0, 0], translation: [1, 2, 3] });
  assert.equal(of(""), null);
  assert.equal(of("mounting { pose { tx: 1 } }"), null);
  assert.equal(of("mounting { pose { qw: 1 tx: 1e7 } }"), null);
});

test("temperature and links of a probe", () => {
  const of = (text) => decodeLinkResponse(encode("LinkResponse", `id: 1 info { ${text} }`)).info.status;
  assert.deepEqual([of("").temperatureC, of("").links, of("temperature_c: 47.5").temperatureC], [null, [], 47.5]);
  const link = 'links { name: "mq\\ntt" clients: 1 descriptors_coalesced: 2 messages_refused: 3 ' +
    "authentication_failures: 4 fault: true } ";
  assert.deepEqual(of(link).links, [{ name: "mq?tt", clients: 1, descriptorsCoalesced: 2, messagesRefused: 3,
                                      authenticationFailures: 4, fault: true }]);
  assert.equal(of(link.repeat(20)).links.length, 8);
});

test("the calibration of a probe", () => {
  const of = (text) =>
    decodeLinkResponse(encode("LinkResponse", `id: 1 get_calibration { ${text} }`)).calibration;
  assert.deepEqual(of(""), { id: 0, file: "", absolute: false, lenses: [], report: null });
  const lens = 'lens { width: 640 height: 480 model: "mei" max_angle_deg: 95 response: TABLE vignetting: true ' +
    "noise: true } ";
  const whole = of(`calibration_id: 12 file: "rig.textproto" absolute: true ${lens} lens { response: 9 } ` +
    "report { geometry_time_s: 1700000000 rms_px: 0.125 points: 4321 seen_deg: [88.5, 87.5] " +
    "direction_3_sigma_deg: [0.02, 0.03] photometry_time_s: -1 }");
  assert.deepEqual(whole, {
    id: 12, file: "rig.textproto", absolute: true,
    lenses: [
      { width: 640, height: 480, model: "mei", maxAngleDeg: 95, response: "table", vignetting: true, noise: true },
      { width: 0, height: 0, model: "", maxAngleDeg: 0, response: "unknown", vignetting: false, noise: false },
    ],
    report: { geometryTimeS: 1_700_000_000, rmsPx: 0.125, points: 4321, seenDeg: [88.5, 87.5],
              direction3SigmaDeg: [0.02, 0.03], photometryTimeS: -1 },
  });
  assert.equal(of(lens.repeat(20)).lenses.length, 2);
  assert.match(decode("LinkRequest", encodeLinkRequest(7, { ask: "get_calibration" })), /get_calibration/);
});

test("responses: an estimator that this version does not know is an error", () => {
  const of = (text) => decodeLinkResponse(encode("LinkResponse", `id: 1 get_config { ${text} }`));
  assert.equal(of("kind: ESTIMATOR_KIND_MARKER").estimator.config.band, 6);
  for (const text of ["", "kind: 9", "kind: 1 estimator { band: 7 }", "kind: 1 estimator { setting: 5 }",
                      "kind: 1 estimator { setting: 0 }", "kind: 1 estimator { panorama { epsilon: 1 } }",
                      "kind: 1 estimator { panorama { epsilon: nan } }",
                      "kind: 1 estimator { panorama { smoothing: 3 } }",
                      "kind: 1 estimator { marker { max_faces: 1 } }"])
    assert.equal(of(text).error?.code, "data_loss", text);
});

test("responses: damaged messages are accepted and refused as by protobuf", () => {
  const random = generator(7);
  let refused = 0;
  for (let i = 0; i < 300; ++i) {
    const bytes = whole.slice(0, i % 3 === 0 ? Math.floor(random() * whole.length) : whole.length);
    for (let k = 0; k < 1 + (i % 2); ++k) bytes[Math.floor(random() * bytes.length)] = Math.floor(random() * 256);
    let ours = true;
    try {
      decodeLinkResponse(bytes);
    } catch (cause) {
      assert.ok(cause instanceof DecodeError && cause.code === "data_loss", String(cause));
      ours = false;
    }
    assert.equal(ours, decode("LinkResponse", bytes) !== null, Buffer.from(bytes).toString("hex"));
    if (!ours) ++refused;
  }
  assert.ok(refused > 50 && refused < 290, `${refused} of 300 were refused`);
});
