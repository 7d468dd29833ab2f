// WebXR's light estimation from a real lightwelld, in headless Chromium with an emulated device: values, times and
// failures. usage: node --test webxr_api_test.mjs; environment: that of webxr_page.mjs, LIGHTWELL_PROTOC,
// LIGHTWELL_PROTO (the folder proto)
import assert from "node:assert/strict";
import { X509Certificate, createHash } from "node:crypto";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { FakeProbe, decode, encode, vector } from "../../host_sdk/typescript/fake_probe.mjs";
import { Browser, until } from "../dashboard/browser.mjs";
import { pairedToken } from "../dashboard/daemon.mjs";
import { WebXrPages } from "./webxr_page.mjs";

let pages;
let daemon;
before(async () => {
  pages = await WebXrPages.start();
  daemon = await pages.daemon("");
});
after(() => pages?.stop());

const json = JSON.stringify;
/** writePanorama(): azimuth 40°, elevation 30°. */
const lamp = [0.557, 0.5, -0.663];
const near = (got, expected, tolerance = 0.01) =>
  assert.ok(got.length === expected.length && got.every((v, k) => Math.abs(v - expected[k]) < tolerance),
            `${json(got)} is not ${json(expected)}`);
const attempt = (page, call) => page.evaluate(`api.attempt(() => ${call})`);

/** A page with a device that was given the light of the daemon; options: as text. */
async function litPage(options = "{}", address = daemon.address) {
  const page = await pages.page();
  await page.evaluate("api.installDevice()");
  assert.equal(await attempt(page, `api.provide("${address}", ${options})`), "provided");
  return page;
}
const estimated = (page) => until(() => page.evaluate("api.estimate()"), "an estimate");

test("the feature is granted where it is requested, required or optional, and nothing else changes", async () => {
  const page = await litPage();
  for (const kind of ["requiredFeatures", "optionalFeatures"]) {
    const features = await page.evaluate(`api.start({ ${kind}: ["local-floor", "light-estimation"] })`);
    assert.deepEqual(features.sort(), ["light-estimation", "local", "local-floor", "viewer"]);
    assert.equal(await page.evaluate("session.preferredReflectionFormat"), "rgba16f");
    await page.evaluate("session.end()");
  }
  assert.deepEqual((await page.evaluate(
    'navigator.xr.requestSession("immersive-ar").then((it) => [...(globalThis.plain = it).enabledFeatures])')).sort(),
    ["local", "viewer"]);
  assert.match(await attempt(page, "plain.requestLightProbe()"),
               /^NotSupportedError: this session has no 'light-estimation': name it in requiredFeatures or optional/);
  await page.evaluate("plain.end()");
  assert.equal(await page.evaluate('navigator.xr.isSessionSupported("immersive-ar")'), true);
  assert.equal(await attempt(page, 'navigator.xr.requestSession("immersive-ar", { requiredFeatures: ["telepathy"] })'),
               "another error: One or more required features are not supported by the device.");
  // Without the provider, the feature is unknown again.
  await page.evaluate("estimation.end()");
  assert.match(await attempt(page, "api.start()"), /required features are not supported/);
  await page.close();
});

test("an estimate has the specification's types and the probe's values", async () => {
  const page = await litPage("{ scale: 0.5 }");
  await page.evaluate("api.start()");
  const found = await estimated(page);
  assert.equal(found.harmonics.length, 27);
  near(found.direction, [...lamp, 0]);
  // pi sin²(0.09) times 180/256 * 2^7, half of it.
  near(found.intensity, [1.142, 1.079, 0.952, 1], 0.05);
  assert.deepEqual(await page.evaluate(`api.inFrame((frame) => {
    const { sphericalHarmonicsCoefficients: c, primaryLightDirection: d } = frame.getLightEstimate(probe);
    return [c instanceof Float32Array, d instanceof DOMPointReadOnly, probe instanceof EventTarget];
  })`), [true, true, true]);
  await page.close();
});

test("signs of ARCore on request", async () => {
  const values = [];
  for (const signs of ["positive", "condon_shortley"]) {
    const page = await litPage(`{ signs: "${signs}" }`);
    await page.evaluate("api.start()");
    values.push((await estimated(page)).harmonics);
    await page.close();
  }
  const odd = [1, 3, 5, 7];
  near(values[1], values[0].map((v, i) => (odd.includes(Math.floor(i / 3)) ? -v : v)), 1e-6);
  assert.ok(Math.abs(values[0][3]) > 0.1);
});

test("the probe hangs where the page says, or where the probe was mounted, in a space of the session's", async () => {
  const half = Math.SQRT1_2;
  // A quarter turn to the left about +Y: what the probe sees at -Z is at the session's -X.
  const turned = [lamp[2], lamp[1], -lamp[0]];
  const pose = `{ rotation: [0, ${half}, 0, ${half}], translation: [1, 2, 3] }`;
  const check = async (options, address) => {
    const page = await litPage(options, address);
    // IWER 2.5 makes spaces of NaN from offsets, so that the offset itself is looked at.
    await page.evaluate(`XRReferenceSpace.prototype.getOffsetReferenceSpace = function ({ position, orientation }) {
      globalThis.offset = [position, orientation].flatMap(({ x, y, z, w }) => [x, y, z, w]);
      return this;
    }`);
    await page.evaluate('api.start({ requiredFeatures: ["light-estimation", "anchors"] })');
    near((await estimated(page)).direction, [...turned, 0]);
    // The axes of the probe's space are those of "local", because three.js does not look at it.
    near(await page.evaluate("offset"), [1, 2, 3, 1, 0, 0, 0, 1], 1e-5);
    return page;
  };
  const page = await check(`{ pose: ${pose} }`);
  await page.evaluate("estimation.pose = { rotation: [0, 0, 0, 1], translation: [0, 0, 0] }");
  await until(async () => Math.abs((await page.evaluate("api.estimate()")).direction[0] - lamp[0]) < 0.01,
              "the new pose");
  await page.close();

  const mounting = join(pages.folder, "room.textproto");
  writeFileSync(mounting, `pose { qy: ${half} qw: ${half} tx: 1 ty: 2 tz: 3 }\n`);
  await (await check("{}", (await pages.daemon("", [], ["--mounting", mounting])).address)).close();

  await (await check(`{ space: (session) => new Promise((resolve) => session.requestAnimationFrame((_, frame) =>
    frame.createAnchor(new XRRigidTransform({ x: 1, y: 2, z: 3 }, { x: 0, y: ${half}, z: 0, w: ${half} }), base)
      .then((anchor) => resolve(anchor.anchorSpace)))) }`)).close();

  // Fixed to the headset, which turns.
  const worn = await litPage('{ space: "viewer" }');
  await worn.evaluate("api.start()");
  await worn.evaluate(`device.quaternion.set(0, ${half}, 0, ${half})`);
  await until(async () => {
    const found = await worn.evaluate("api.estimate()");
    return found && Math.abs(found.direction[0] - turned[0]) < 0.01 && Math.abs(found.direction[2] - turned[2]) < 0.01;
  }, "the light turns with the headset");
  await worn.close();
  const none = await litPage('{ space: "unbounded" }');
  assert.match(await attempt(none, "api.start()"),
               /^NotSupportedError: the probe's light needs the reference space 'unbounded', which this session does/);
  await none.close();
});

test("the cube map has the room without the primary light, in both formats, and announces its changes", async () => {
  const { address } = await pages.daemon("", ["estimator { panorama { environment_edge: 64 } }"]);
  const page = await litPage("{ scale: 0.5 }", address);
  // Before the map comes, a cube map shows the harmonics.
  await until(() => page.evaluate("estimation.probe.latest().environment !== null"), "a map");
  for (const format of ["rgba16f", "srgba8"]) {
    await page.evaluate(`api.start(undefined, { reflectionFormat: "${format}" })`);
    assert.equal(await page.evaluate("api.cubeFace(2)"), null);
    await page.evaluate("gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, true); gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1)");
    const before = await page.evaluate("api.glState()");
    await until(async () => (await page.evaluate("api.estimate()"), await page.evaluate("changes")) > 0, "a cube map");
    const [up, down] = [await page.evaluate("api.cubeFace(2)"), await page.evaluate("api.cubeFace(3)")];
    assert.equal(await page.evaluate("api.glState()"), before);
    // Blue above, warm below: half of 120 126 140 and of 130 110 90, times 2/256.
    const center = 4 * (8 * 16 + 8);
    const expect = (face, values) => near(face.slice(center, center + 3).map((v) => (format === "srgba8" ?
      ((v / 255 + 0.055) / 1.055) ** 2.4 : v)), values, 0.02);
    expect(up, [0.469, 0.492, 0.547]);
    expect(down, [0.508, 0.43, 0.352]);
    assert.ok(await page.evaluate("binding.getReflectionCubeMap(probe) === binding.getReflectionCubeMap(probe)"));
    await page.evaluate("session.end()");
    assert.match(await attempt(page, "binding.getReflectionCubeMap(probe)"), /^InvalidStateError: the session has end/);
    assert.match(await attempt(page, "session.requestLightProbe()"), /^InvalidStateError: the session has ended/);
  }
  assert.match(await attempt(page, 'api.start(undefined, { reflectionFormat: "jpeg" })'),
               /^TypeError: 'jpeg' is no XRReflectionFormat/);
  await page.close();
});

test("harmonics alone, on request: they hold the lamp, and there is no cube map", async () => {
  const page = await litPage('{ detail: "harmonics" }');
  await page.evaluate("api.start()");
  const { direction, intensity, harmonics } = await estimated(page);
  assert.deepEqual([direction, intensity], [[0, 1, 0, 0], [0, 0, 0, 1]]);
  for (let i = 0; i < 20; ++i) await page.evaluate("api.estimate()");
  await new Promise((resume) => setTimeout(resume, 500));
  assert.deepEqual(await page.evaluate("[api.cubeFace(2), changes]"), [null, 0]);
  await page.close();
  const all = await litPage();
  await all.evaluate("api.start()");
  const apart = await estimated(all);
  // Band 0 of a lamp: its irradiance times Y00, almost.
  near([harmonics[0] - apart.harmonics[0]], [0.2821 * apart.intensity[0]], 0.02);
  await all.close();
});

test("without light the estimate is null within half a second, and comes back with the probe", async () => {
  const other = await pages.daemon("");
  const page = await litPage("{}", other.address);
  await page.evaluate("api.start()");
  await estimated(page);
  await page.evaluate(`(function watch() {
    session.requestAnimationFrame((_, frame) => {
      if (frame.getLightEstimate(probe)) globalThis.lastEstimate = Date.now();
      watch();
    });
  })()`);
  await new Promise((resume) => setTimeout(resume, 300));
  const killed = Date.now();
  await other.stop("SIGKILL");
  await new Promise((resume) => setTimeout(resume, 1200));
  const last = (await page.evaluate("lastEstimate")) - killed;
  console.log(`# last estimate ${last} ms after the end of the probe`);
  assert.ok(last < 500, `${last}`);
  assert.equal(await page.evaluate("api.estimate()"), null);
  assert.match(await attempt(page, "session.end().then(() => api.start())"),
               /^NotSupportedError: 'light-estimation' is required, and the probe cannot be reached/);
  // Where it is optional, the session starts, and light comes with the probe.
  const features = await page.evaluate('api.start({ optionalFeatures: ["light-estimation"] })');
  assert.ok(features.includes("light-estimation"));
  assert.equal(await page.evaluate("api.estimate()"), null);
  await page.close();
});

test("misuse fails as the specification says", async () => {
  const page = await litPage();
  await page.evaluate("api.start()");
  await estimated(page);
  assert.match(await attempt(page, "api.inFrame((frame) => frame).then((frame) => frame.getLightEstimate(probe))"),
               /^InvalidStateError/);
  assert.match(await attempt(page, "api.inFrame((frame) => frame.getLightEstimate({}))"), /^TypeError/);
  await page.evaluate("globalThis.first = probe; session.end().then(() => api.start())");
  await until(() => page.evaluate("probe !== first"), "a second session");
  assert.match(await attempt(page, "api.inFrame((frame) => frame.getLightEstimate(first))"),
               /^InvalidStateError: the light probe is of another session/);
  assert.match(await attempt(page, "binding.getReflectionCubeMap({})"), /^TypeError/);
  assert.match(await attempt(page, `api.provide("${daemon.address}")`),
               /^InvalidStateError: another probe gives its light already: call its end/);
  await page.close();
});

test("no WebXR, no probe, a wrong address, a wrong option: each a clear error", async () => {
  const page = await pages.page();
  await page.evaluate('Object.defineProperty(navigator, "xr", { value: undefined, configurable: true })');
  assert.match(await attempt(page, `api.provide("${daemon.address}")`),
               /^NotSupportedError: this page has no WebXR: .*iwer/);
  await page.evaluate("api.installDevice()");
  const refused = async (address, options, text) =>
    assert.match(await attempt(page, `api.provide(${json(address)}, ${options})`), text);
  await refused("ws://127.0.0.1:1", "{}", /^NetworkError: no answer within 2000 ms .*the probe is not reachable/);
  await refused("wss://nobody.invalid", "{ connectTimeoutMs: 300 }", /^NetworkError: no answer within 300 ms/);
  await refused("grpc://127.0.0.1:7420", "{}", /^SyntaxError: 'grpc:.*' is not a valid address of a probe: write wss:/);
  for (const [options, text] of [
    ["{ scale: 0 }", "scale is 1e-9 to 1e9"], ["{ scale: NaN }", "scale is"], ["{ signs: 1 }", "signs is"],
    ["{ detail: 'none' }", "detail is"], ["{ reflectionEdge: 20 }", "reflectionEdge is"],
    ["{ native: true }", "native is"], ["{ space: 3 }", "space is"],
    ["{ pose: { rotation: [0, 0, 0, 2], translation: [0, 0, 0] } }", "pose is"],
    ["{ pose: { rotation: [0, 0, 0, 1], translation: [0, NaN, 0] } }", "pose is"],
  ])
    await refused(daemon.address, options, new RegExp(`^TypeError: provideLightEstimation: ${text}`));
  // After a failure the browser is as it was.
  assert.equal(await page.evaluate('"requestLightProbe" in XRSession.prototype'), false);
  await page.close();
});

test("a wrong token", async () => {
  const keys = join(pages.folder, "keys");
  const token = await pairedToken(pages.folder, keys);
  const secure = await pages.daemon("", [], ["--security", "tls", "--web-security", "tls", "--keys", keys]);
  // The browser trusts this key and no other.
  const spki = createHash("sha256").update(new X509Certificate(readFileSync(join(keys, "probe.pem"))).publicKey
    .export({ type: "spki", format: "der" })).digest("base64");
  const trusting = await Browser.start([`--ignore-certificate-errors-spki-list=${spki}`]);
  try {
    const page = await trusting.newPage();
    // The browser decides here that it sends no client certificate. For a WebSocket alone it refuses to connect.
    await page.goto(secure.page);
    await page.goto(`${pages.origin}/test.html`);
    await page.until("globalThis.api !== undefined");
    await page.evaluate("api.installDevice()");
    for (const wrong of [`"${token}x"`, "undefined"])
      assert.match(await attempt(page, `api.provide("${secure.address}", { token: ${wrong}, connectTimeoutMs: 8000 })`),
                   /^NotAllowedError: the probe refused this client/);
    assert.equal(await attempt(page, `api.provide("${secure.address}", { token: "${token}" })`), "provided");
    assert.match(await attempt(page, 'api.provide("ws://192.0.2.1", { token: "secret" })'),
                 /^SyntaxError: .*a token is sent only over TLS/);
  } finally {
    await trusting.stop();
  }
});

test("a probe with a newer wire format", async () => {
  const probe = await FakeProbe.start();
  const newer = encode("LightingDescriptor", decode("LightingDescriptor", vector("v1_lamp_at_plus_x"))
    .replace(/wire_version: 1/, "wire_version: 2"));
  const timer = setInterval(() => probe.clients.forEach((client) => client.send(newer)), 50);
  const page = await pages.page();
  await page.evaluate("api.installDevice()");
  assert.match(await attempt(page, `api.provide("${probe.address}")`),
               /^NotSupportedError: the probe's messages cannot be decoded .*wire_version is 2.*: update the package/);
  clearInterval(timer);
  await probe.stop();
  await page.close();
});

test("where the browser estimates light itself, the page chooses", async () => {
  for (const [native, ours] of [["replace", true], ["prefer", false]]) {
    const page = await pages.page();
    await page.evaluate(`api.installDevice(["light-estimation"]);
      globalThis.nativeProbe = new EventTarget();
      XRSession.prototype.requestLightProbe = async () => nativeProbe;
      XRFrame.prototype.getLightEstimate = () => "the browser's"`);
    assert.equal(await attempt(page, `api.provide("${daemon.address}", { native: "${native}" })`), "provided");
    const features = await page.evaluate("api.start()");
    assert.equal(features.filter((name) => name === "light-estimation").length, 1);
    assert.equal(await page.evaluate("probe !== nativeProbe"), ours);
    const estimate = await page.evaluate("api.inFrame((frame) => frame.getLightEstimate(probe))");
    assert.equal(estimate === "the browser's", !ours);
    await page.close();
  }
});
