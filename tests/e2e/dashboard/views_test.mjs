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

/** The page and a link whose estimator is of this kind. */
async function serve(kind, planeUpdate) {
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
    encode("LinkResponse", `id: ${id} get_config { kind: ${kind} }`) : respond(id, text);
  probe.info = infoOf("attic");
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
  const { probe, page } = await serve("ESTIMATOR_KIND_SPECULAR", update);
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
    assert.equal(await page.evaluate('document.getElementById("marker-view").hidden'), true);
  } finally {
    clearInterval(timer);
  }
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
