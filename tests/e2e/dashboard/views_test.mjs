// Views of the dashboard that need another estimator, or a probe without three.js: the page with a probe's link that
// the test plays (tests/host_sdk/typescript/fake_probe.mjs).
// usage: as dashboard_test.mjs, with LIGHTWELL_DASHBOARD (the page's folder), LIGHTWELL_PROTOC and LIGHTWELL_PROTO
import assert from "node:assert/strict";
import { existsSync, readFileSync } from "node:fs";
import { createServer } from "node:http";
import { dirname, extname, join } from "node:path";
import { after, before, test } from "node:test";

import { FakeProbe, WebSocketServer, descriptor, encode, infoOf } from "../../host_sdk/typescript/fake_probe.mjs";
import { Browser, until } from "./browser.mjs";

const types = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml" };
const sdk = dirname(process.env.LIGHTWELL_MODULE);

let browser;
const servers = [];
before(async () => {
  browser = await Browser.start();
});
after(async () => {
  await browser?.stop();
  for (const server of servers) {
    server.closeAllConnections();
    server.close();
  }
});

/** The page and a link whose estimator is of this kind. info: further fields of InfoResponse; calibration: a
 *  GetCalibrationResponse, without which the probe does not know the request. */
async function serve(kind, { planeUpdate, info = "", calibration = null } = {}) {
  const probe = new FakeProbe();
  const http = createServer(({ url }, response) => {
    const file = url.startsWith("/sdk/") ? join(sdk, url.slice(5)) :
      join(process.env.LIGHTWELL_DASHBOARD, url === "/" ? "index.html" : url);
    const body = url === "/three/load.js" ? "export const three = null;" : existsSync(file) && readFileSync(file);
    response.writeHead(body ? 200 : 404, { "content-type": types[extname(url === "/" ? file : url)] ?? "text/plain" });
    response.end(body || undefined);
  });
  probe.server = new WebSocketServer({ server: http, handleProtocols: (offered) => [...offered][0] });
  probe.server.on("connection", (socket, request) =>
    request.url === "/v1/planes" ? socket.send(planeUpdate) : probe.accept(socket, request));
  const respond = probe.respond.bind(probe);
  probe.respond = (id, text) => text.includes("get_config") ?
    encode("LinkResponse", `id: ${id} get_config { kind: ${kind} }`) :
    text.includes("get_calibration") && calibration !== null ?
      encode("LinkResponse", `id: ${id} get_calibration { ${calibration} }`) : respond(id, text);
  probe.info = infoOf("attic", info);
  servers.push(http);
  await new Promise((listening) => http.listen(0, "127.0.0.1", listening));
  const page = await browser.newPage();
  await page.goto(`http://127.0.0.1:${http.address().port}/`);
  await page.until('document.getElementById("link-state-text").textContent === "live" || ' +
    '!document.getElementById("live").hidden');
  return { probe, page };
}

const pairs = (id) => `Object.fromEntries([...document.querySelectorAll("#${id} dt")].map((dt) =>
  [dt.textContent, dt.nextSibling.textContent]))`;

test("a marker: its pose while it is in view, and for how long it has not been", async () => {
  const { probe, page } = await serve("ESTIMATOR_KIND_MARKER");
  // At 0.3 m to the right, 0.4 m ahead.
  const pose = encode("LightingDescriptor", "T_probe_origin { qw: 1 tx: 0.3 tz: -0.4 }");
  let sequence = 0;
  const timer = setInterval(() =>
    probe.publish(Buffer.concat([descriptor(++sequence, probe.clockNow()), pose])), 50);
  try {
    await page.until('document.getElementById("marker-found").textContent === "In view"');
    const { "Right, x": x, "Ahead, −z": ahead, Distance: distance } = await page.evaluate(pairs("marker-pose"));
    assert.deepEqual([x, ahead, distance], ["0.30 m", "0.40 m", "0.50 m"]);
    assert.equal(await page.evaluate('document.getElementById("plane-view").hidden'), true);
    assert.equal(await page.text("spheres-note"), "2-D view");
  } finally {
    clearInterval(timer);
  }
  await page.until('/^Not in view for 1\\./.test(document.getElementById("marker-found").textContent)');
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("a plane: the share of the directions that was seen, and where to move next", async () => {
  // Level 60: 7321 nodes. All of levels 0 to 30 are seen, theta up to 45°: 1861 nodes.
  const bytes = Array.from({ length: Math.ceil(7321 / 8) }, (_, i) =>
    Array.from({ length: 8 }, (_, k) => (8 * i + k < 1861 ? 1 << k : 0)).reduce((a, b) => a | b));
  const states = bytes.map((byte) => `\\${byte.toString(8).padStart(3, "0")}`).join("");
  const update = encode("PlaneUpdate", `wire_version: 1 capture: 5 revision: 9 units: UNITS_RELATIVE size_m: 0.21 ` +
    `lumisphere_levels: 1 coverage_levels: 60 key_interval_ms: 1000 gloss_alpha: 0.04 ` +
    `T_probe_plane { qw: 1 tz: -0.5 } tile_revision: 1 tile_revision: 1 tiles { index: 1 states: "${states}" }`);
  const { probe, page } = await serve("ESTIMATOR_KIND_SPECULAR", { planeUpdate: update });
  let sequence = 0;
  const timer = setInterval(() => probe.publish(descriptor(++sequence, probe.clockNow())), 50);
  try {
    const facts = await until(async () => {
      const found = await page.evaluate(pairs("plane-facts"));
      return found.Seen && found;
    }, "the coverage");
    // Caps of half-angle 45.75° in 80.75° (nodes stand for half a level more): (1 - cos) of each.
    const expected = (100 * (1 - Math.cos((45.75 * Math.PI) / 180))) / (1 - Math.cos((80.25 * Math.PI) / 180));
    assert.ok(Math.abs(parseFloat(facts.Seen) - expected) < 1, `${facts.Seen}, expected ${expected}`);
    // From 45° to 79.5°, the last level that counts.
    assert.ok(Math.abs(parseFloat(facts["Largest gap"]) - 34.5) < 3, facts["Largest gap"]);
    assert.equal(facts.Capture, "keep moving");
    assert.equal(facts.Texture, "stays in the probe");
    // The page of the estimator that needs most modules.
    const loaded = await page.evaluate(`["navigation", "resource"].flatMap((type) =>
      performance.getEntriesByType(type)).map(({ name }) => new URL(name).pathname)`);
    assert.ok(loaded.includes("/plane_view.js") && loaded.includes("/sdk/plane_reader.js"), `${loaded}`);
    assert.equal(await page.evaluate('document.getElementById("marker-view").hidden'), true);
  } finally {
    clearInterval(timer);
  }
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("calibration with its report, temperature, and a fault of a link", async () => {
  const { page } = await serve("ESTIMATOR_KIND_PANORAMA", {
    info: 'temperature_c: 61.25 links { name: "web" clients: 3 } ' +
      'links { name: "mqtt" messages_refused: 7 fault: true }',
    calibration: 'calibration_id: 0xab file: "<b>rig" absolute: true lens { width: 640 height: 480 ' +
      'model: "kannala_brandt" max_angle_deg: 95 response: TABLE vignetting: true noise: true } ' +
      "report { geometry_time_s: 1700000000 rms_px: 0.125 points: 4321 seen_deg: 88.5 direction_3_sigma_deg: 0.02 }",
  });
  const facts = await until(async () => {
    const found = await page.evaluate(pairs("calibration-facts"));
    return found.File && found;
  }, "the calibration");
  assert.deepEqual(facts, {
    File: "<b>rig", Identity: "000000ab", Units: "absolute, lux and cd/m²",
    Lens: "640 × 480, Kannala-Brandt up to 95.0°; response table, vignetting corrected, noise known",
    Geometry: "2023-11-14: 0.13 px RMS over 4,321 points", "Lens, boards": "seen up to 88.5°, directions ± 0.02° (3 σ)",
    Photometry: "not reported",
  });
  await until(async () => (await page.evaluate(pairs("link-facts")))["Temperature of the probe"] === "61.3 °C",
              "the temperature");
  const links = await page.evaluate(
    '[...document.querySelectorAll("#links tbody tr")].map((row) => [...row.cells].map((cell) => cell.textContent))');
  assert.deepEqual(links, [["Browsers", "3", "0", "0", "0"], ["MQTT – fault, see the log", "0", "0", "7", "0"]]);
  await page.screenshot(join(process.env.LIGHTWELL_SCREENSHOTS, "calibration.png"));
  await page.view(390, 844, { mobile: true, scale: 2 });
  assert.equal(await page.evaluate("document.documentElement.scrollWidth"), 390);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("an older probe, which knows none of these: nothing of them is shown", async () => {
  const { page } = await serve("ESTIMATOR_KIND_PANORAMA");
  await until(async () => (await page.evaluate(pairs("link-facts")))["Clients of the probe"] === "2", "the connection");
  assert.equal((await page.evaluate(pairs("link-facts")))["Temperature of the probe"], undefined);
  for (const id of ["calibration", "links", "probe-record"])
    assert.equal(await page.evaluate(`document.getElementById("${id}").hidden`), true, id);
  assert.equal(await page.evaluate('document.getElementById("probe-record-none").hidden'), false);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test("directions: the map's projection, and ellipses of two standard deviations", async () => {
  const { page } = await serve("ESTIMATOR_KIND_PANORAMA");
  const at = await page.evaluate(`import("/directions.js").then(({ project }) =>
    [[0, 0, -1], [1, 0, 0], [0, 1, 0], [-1e-9, 0, 1], [0, -1, 0]].map(project))`);
  const expected = [[0, 0], [0.5412, 0], [0, 1], [-1, 0], [0, -1]];
  at.flat().forEach((v, i) => assert.ok(Math.abs(v - expected.flat()[i]) < 1e-4, `${at}`));
  // Of an isotropic covariance of 0.1 rad a circle of 0.2 rad; of one along u alone a line.
  const angles = await page.evaluate(`import("/directions.js").then(({ ellipse }) =>
    [[0.01, 0, 0.01], [0.01, 0, 0]].map((directionCovariance) =>
      ellipse({ direction: [0.6, 0, -0.8], directionCovariance }, 2, 8)
        .map((d) => Math.acos(Math.min(1, 0.6 * d[0] - 0.8 * d[2])))))`);
  angles[0].forEach((angle) => assert.ok(Math.abs(angle - 0.2) < 1e-6, `${angles[0]}`));
  assert.ok(Math.abs(Math.max(...angles[1]) - 0.2) < 1e-6 && Math.min(...angles[1]) < 1e-6, `${angles[1]}`);
  await page.close();
});
