// The dashboard in headless Chromium with a real lightwelld.
// usage: node --test dashboard_test.mjs; environment: that of browser.mjs and daemon.mjs, LIGHTWELL_MODULE
// (lightwell.js), LIGHTWELL_SCREENSHOTS (folder for pictures of the page)
import assert from "node:assert/strict";
import { X509Certificate, createHash } from "node:crypto";
import { mkdirSync, mkdtempSync, readFileSync, renameSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";

import { Browser, until } from "./browser.mjs";
import { Daemon, pairedToken, writePanorama } from "./daemon.mjs";

const { WebSocket } = createRequire(import.meta.url)(process.env.LIGHTWELL_NODE_WS);
const { connect, decodeDescriptor, readRecording } = await import(pathToFileURL(process.env.LIGHTWELL_MODULE).href);
const pictures = process.env.LIGHTWELL_SCREENSHOTS;
mkdirSync(pictures, { recursive: true });

const folder = mkdtempSync(join(tmpdir(), "lightwell-dashboard-"));
const panorama = join(folder, "lamp.hdr");
writePanorama(panorama);
const recordings = join(folder, "recordings");
const switching = `sim:${panorama}?lamp_switch=1s`;

let daemon;
let browser;
let page;
before(async () => {
  mkdirSync(recordings);
  daemon = await Daemon.start({ camera: switching, more: ["--recordings", recordings] });
  browser = await Browser.start();
  page = await browser.newPage();
  await page.goto(daemon.page);
  await page.until('document.getElementById("link-state").dataset.state === "connected"');
});
after(async () => {
  await browser?.stop();
  await daemon?.stop();
  rmSync(folder, { recursive: true, force: true });
});

const rows = 'document.getElementById("lights").tBodies[0].rows.length';

test("numbers move, and there is no complaint in the console", async () => {
  const sequence = async () => Number(/\d+/.exec(await page.text("rate-sub"))?.[0]);
  const first = await until(sequence, "a descriptor");
  await until(async () => (await sequence()) > first + 15, "further descriptors");
  await until(async () => Math.abs(Number(await page.text("rate")) - 30) < 3, "30 descriptors a second");
  await until(async () => Number(await page.text("latency")) > 0, "a latency");
  assert.ok(Number(await page.text("bytes")) > 50);
  assert.match(await page.text("bound-sub"), /of the irradiance/);
  await until(async () => /lamp\.hdr.*panorama.*firmware/.test(await page.text("probe-detail")), "what the probe is");
  await page.until('document.querySelector("#rate-spark polyline")?.getAttribute("points").split(" ").length > 3');
  await page.until(`${rows} === 1`);
  // Where the lamp is: azimuth 40°, elevation 30°.
  const [azimuth, elevation] = await page.evaluate(
    '[...document.querySelectorAll("#lights tbody td")].slice(1, 3).map((cell) => parseFloat(cell.textContent))');
  assert.ok(Math.abs(azimuth - 40) < 1 && Math.abs(elevation - 30) < 1, `${azimuth}, ${elevation}`);
  assert.deepEqual(page.complaints, []);
});

test("page and client have less than 200 kB, three.js apart", async () => {
  const bytes = await page.evaluate(`["navigation", "resource"].flatMap((type) => performance.getEntriesByType(type))
    .filter(({ name }) => !name.endsWith("three.min.js")).reduce((sum, entry) => sum + entry.decodedBodySize, 0)`);
  assert.ok(bytes > 100e3 && bytes < 200e3, `${bytes}`);
});

test("a lamp that is switched off is gone from the page within 100 ms of its descriptor", async () => {
  // Both clocks are those of this machine: time origin plus time since then.
  const wall = () => performance.timeOrigin + performance.now();
  const came = [];
  const probe = await connect(daemon.address, { WebSocket });
  let lights = null;
  probe.on("descriptor", ({ descriptor }) => {
    if (lights !== null && descriptor.lights.length < lights) came.push(wall());
    lights = descriptor.lights.length;
  });
  await page.evaluate(`{
    const gone = (globalThis.gone = []);
    let rows = ${rows};
    new MutationObserver(() => {
      if (${rows} < rows) gone.push(performance.timeOrigin + performance.now());
      rows = ${rows};
    }).observe(document.getElementById("lights").tBodies[0], { childList: true });
  }`);
  await until(() => came.length >= 6, "the lamp is switched off six times");
  await new Promise((resume) => setTimeout(resume, 500));
  probe.close();
  const gone = await page.evaluate("globalThis.gone");
  const delays = came.slice(1).map((at) => Math.min(...gone.map((t) => Math.abs(t - at))));
  console.log(`# from the descriptor to the page's state, ms: ${delays.map((v) => v.toFixed(1)).join(" ")}`);
  // The median, because WebGL by software on busy processors now and then stops the page for longer.
  const sorted = [...delays].sort((a, b) => a - b);
  assert.ok(sorted[Math.floor(sorted.length / 2)] < 100, `${delays}`);
  assert.ok(sorted.at(-1) < 3000, `${delays}`);
});

test("a setting that is changed here changes the probe, and its effect is shown", async () => {
  const probe = await connect(daemon.address, { WebSocket });
  await page.until('document.querySelector("#settings input[value=balanced]").checked');
  await page.evaluate('document.querySelector("#settings input[value=exact]").click()');
  await page.until('document.getElementById("settings-message").textContent === "Setting is now exact."');
  await until(() => probe.latest().descriptor?.setting === "exact", "descriptors of the new setting");
  await until(async () => (await page.text("setting")) === "exact", "the page shows it");
  await page.until('/%/.test(document.querySelector("#effect tbody tr td:last-child").textContent)', "the effect");
  // A number that is out of its limits is refused by the probe or by the field, and nothing changes.
  await page.evaluate(`{
    const input = document.getElementById("option-common-maxLights");
    input.max = "";
    input.value = "65";
    input.dispatchEvent(new Event("change", { bubbles: true }));
  }`);
  await page.until('/not changed.*max_lights/.test(document.getElementById("settings-message").textContent)');
  assert.equal((await probe.estimator()).config.maxLights, 16);
  probe.close();
});

test("it works by keyboard alone", async () => {
  // The table of lights is hidden while the lamp is off: the lamp has just been switched on.
  await page.until('document.getElementById("lights-region").hidden');
  await page.until('!document.getElementById("lights-region").hidden');
  await page.evaluate("document.activeElement.blur(); scrollTo(0, 0)");
  const reached = new Set();
  for (let i = 0; i < 40; ++i) {
    await page.key("Tab");
    const name = await page.evaluate(`{
      const e = document.activeElement;
      e.id || e.value || e.getAttribute("aria-label") || e.className || e.tagName;
    }`);
    if (reached.has(name)) break;
    reached.add(name);
  }
  for (const name of ["skip", "lights-region", "option-common-maxLights", "option-panorama-smoothing", "record",
                      "probe-record"])
    assert.ok(reached.has(name), `${name} of ${[...reached]}`);
  await page.evaluate('document.querySelector("#settings input:checked").focus()');
  const visible = 'getComputedStyle(document.querySelector("#settings input:checked + span")).outlineStyle';
  await page.key("ArrowRight");
  await page.until('/^Setting is now/.test(document.getElementById("settings-message").textContent)');
  assert.equal(await page.evaluate(visible), "solid");
});

test("descriptors are recorded, and the file is a recording", async () => {
  await page.evaluate(`{
    // In place of the download: its content.
    URL.createObjectURL = (blob) => {
      globalThis.saved = blob;
      return "data:,";
    };
    document.getElementById("record").click();
  }`);
  await page.until('/[1-9]\\d descriptors/.test(document.getElementById("record-state").textContent)');
  await page.evaluate('document.getElementById("record").click()');
  const bytes = await page.evaluate("saved.arrayBuffer().then((buffer) => Array.from(new Uint8Array(buffer)))");
  const { messages, tornBytes } = readRecording(Uint8Array.from(bytes));
  assert.equal(tornBytes, 0);
  assert.ok(messages.length >= 10);
  const sequences = messages.map((message) => decodeDescriptor(message.bytes).sequence);
  assert.ok(sequences.every((v, i) => i === 0 || v > sequences[i - 1]));
});

test("the probe records on its own disk, started here, and the SDK reads the file", async () => {
  const state = 'document.getElementById("probe-record-state").textContent';
  const click = () => page.evaluate('document.getElementById("probe-record").click()');
  assert.equal(await page.evaluate(state), "");
  await click();
  await page.until(`/^● Recording [1-9]\\d+ descriptors, .* in \\d{8}T\\d{6}Z-0001.lwr$/.test(${state})`);
  // Another client sees it, and cannot start a second one.
  const probe = await connect(daemon.address, { WebSocket });
  assert.equal(probe.info().recording.running, true);
  await assert.rejects(probe.startRecording(), { code: "failed_precondition", message: /runs on the probe already/ });
  await page.screenshot(join(pictures, "recording.png"));
  await click();
  await page.until(`/^Recorded /.test(${state})`);
  await assert.rejects(probe.stopRecording(), { code: "failed_precondition", message: /no recording runs/ });
  const { file } = probe.info().recording;
  probe.close();
  const { messages, tornBytes } = readRecording(new Uint8Array(readFileSync(join(recordings, file))));
  assert.equal(tornBytes, 0);
  assert.ok((await page.evaluate(state)).startsWith(`Recorded ${messages.length} descriptors`));
  const sequences = messages.map((message) => decodeDescriptor(message.bytes).sequence);
  assert.ok(sequences.every((v, i) => i === 0 || v > sequences[i - 1]));
});

test("a recording that the probe refuses or ends is explained", async () => {
  const error = 'document.getElementById("probe-record-error")';
  const click = () => page.evaluate('document.getElementById("probe-record").click()');
  renameSync(recordings, `${recordings}-away`);
  await click();
  await page.until(`/^The recording was not started: .*change recordings.folder$/.test(${error}.textContent)`);
  renameSync(`${recordings}-away`, recordings);
  await click();
  await page.until('document.getElementById("probe-record").textContent === "Stop on the probe"');
  assert.equal(await page.evaluate(`${error}.hidden`), true);
  rmSync(recordings, { recursive: true });
  await page.until(`/^The recording has ended: .*removed$/.test(${error}.textContent)`);
  assert.equal(await page.text("probe-record"), "Start on the probe");
  mkdirSync(recordings);
});

test("the calibration and the counters of each link are shown", async () => {
  const facts = await page.evaluate(`Object.fromEntries([...document.querySelectorAll("#calibration-facts dt")].map(
    (dt) => [dt.textContent, dt.nextSibling.textContent]))`);
  assert.equal(facts.File, "the camera’s own");
  assert.match(facts["Lens 1"], /^160 × 120, Kannala-Brandt up to .*; response linear, vignetting not corrected, /);
  assert.deepEqual([facts["Lens 2"] !== undefined, facts.Report], [true, "none in the file"]);
  const probe = await connect(daemon.address, { WebSocket });
  assert.equal(facts.Identity, probe.info().calibrationId.toString(16).padStart(8, "0"));
  await page.until(`JSON.stringify([...document.querySelectorAll("#links tbody tr")].map(({ cells }) =>
    [cells[0].textContent, cells[1].textContent])) === '[["gRPC","0"],["Browsers","2"]]'`);
  probe.close();
});

test("nothing is wider than a phone, and the pictures are drawn", async () => {
  const views = [
    ["desktop", 1280, 900, {}], ["desktop_dark", 1280, 900, { scheme: "dark" }],
    ["phone", 390, 844, { mobile: true, scale: 2 }],
    ["phone_dark", 390, 844, { mobile: true, scale: 2, scheme: "dark" }],
  ];
  for (const [name, width, height, options] of views) {
    await page.view(width, height, options);
    await new Promise((resume) => setTimeout(resume, 1500));
    assert.equal(await page.evaluate("document.documentElement.scrollWidth"), width, name);
    await page.screenshot(join(pictures, `${name}.png`));
  }
  for (const id of ["directions", "spheres"]) {
    const colours = await page.evaluate(`{
      const copy = document.createElement("canvas");
      copy.width = copy.height = 64;
      const c = copy.getContext("2d", { willReadFrequently: true });
      // WebGL shows its picture only until it is composed, so it is read in the frame that drew it.
      new Promise((done) => requestAnimationFrame(function look() {
        c.drawImage(document.getElementById("${id}"), 0, 0, 64, 64);
        const colours = new Set(new Uint32Array(c.getImageData(0, 0, 64, 64).data.buffer)).size;
        if (colours > 50) done(colours);
        else requestAnimationFrame(look);
      }));
    }`);
    assert.ok(colours > 50, id);
  }
  await page.view(1280, 900);
  assert.deepEqual(page.complaints, []);
});

test("without the owner's consent no picture leaves the probe, and the page says what to do", async () => {
  const refused = async () => (await page.evaluate(
    '[...document.querySelectorAll("#links tbody tr")].find(({ cells }) => cells[0].textContent === "Browsers")' +
    ".cells[3].textContent"));
  const before = await refused();
  await page.evaluate('document.getElementById("preview-toggle").click()');
  const remedy = /owner.*images: IMAGE_RECIPIENTS_ALL_CLIENTS/;
  await until(async () => remedy.test(await page.text("preview-error")), "the remedy");
  assert.equal(await page.evaluate('document.getElementById("preview-picture").hidden'), true);
  assert.equal(await page.text("preview-toggle"), "Show the picture");
  await until(async () => (await refused()) !== before, "the refusal is counted");
  const response = await fetch(`${daemon.page}/v1/preview.jpg`);
  assert.equal(response.status, 403);
  assert.match(response.headers.get("content-type"), /^text\/plain/);
  // The browser writes each answer 403 to the console.
  page.complaints = page.complaints.filter((text) => !/403/.test(text));
});

test("it reconnects by itself after the daemon was killed", async () => {
  await daemon.stop("SIGKILL");
  await page.until('document.getElementById("link-state").dataset.state !== "connected"');
  await page.until('/^This is the light of .* ago/.test(document.getElementById("notice").textContent)');
  await page.screenshot(join(pictures, "daemon_gone.png"));
  daemon = await Daemon.start({ camera: switching, web: `127.0.0.1:${daemon.port}` });
  await page.until('document.getElementById("link-state").dataset.state === "connected"');
  await page.until('/^Reconnections1$/m.test([...document.querySelectorAll("#link-facts dt")]' +
    '.map((dt) => dt.textContent + dt.nextSibling.textContent).join("\\n"))');
  const sequence = Number(/\d+/.exec(await page.text("rate-sub"))[0]);
  await until(async () => Number(/\d+/.exec(await page.text("rate-sub"))[0]) > sequence, "numbers move again");
  // The new daemon has the settings of its start.
  await page.until('document.querySelector("#settings input[value=balanced]").checked');
});

test("over TLS it shows nothing without a token, refuses a wrong one, and forgets it on demand", async () => {
  const keys = join(folder, "keys");
  const token = await pairedToken(folder, keys);
  const secure = await Daemon.start({
    camera: switching, more: ["--keys", keys, "--security", "tls", "--web-security", "tls"],
  });
  // The browser trusts this key and no other, as a user who has checked the certificate.
  const certificate = new X509Certificate(readFileSync(join(keys, "probe.pem")));
  const spki = createHash("sha256").update(certificate.publicKey.export({ type: "spki", format: "der" }))
    .digest("base64");
  // And it has no WebGL.
  const trusting = await Browser.start([`--ignore-certificate-errors-spki-list=${spki}`, "--disable-3d-apis"]);
  try {
    const guest = await trusting.newPage();
    await guest.goto(secure.page);
    await guest.until('!document.getElementById("sign-in").hidden');
    assert.equal(await guest.text("sign-in-title"), "This is a Lightwell");
    assert.equal(await guest.text("probe-name"), "Lightwell");
    assert.equal(await guest.evaluate('document.getElementById("live").hidden'), true);
    assert.deepEqual(guest.complaints, []);
    assert.equal(await guest.evaluate("document.activeElement.id"), "token");
    await guest.screenshot(join(pictures, "sign_in.png"));
    await guest.type("x".repeat(43));
    await guest.key("Enter", "\r");
    await guest.until('!document.getElementById("sign-in-error").hidden');
    assert.match(await guest.text("sign-in-error"), /refused this client/);
    assert.equal(await guest.evaluate('document.getElementById("live").hidden'), true);
    assert.equal(await guest.evaluate("JSON.stringify([{ ...sessionStorage }, { ...localStorage }])"), "[{},{}]");
    await guest.type(token);
    await guest.key("Enter", "\r");
    await guest.until('document.getElementById("link-state").dataset.state === "connected"');
    await guest.until(`${rows} >= 0 && document.getElementById("rate").textContent > "0"`);
    await guest.until('document.getElementById("spheres-note").textContent === "2-D view"');
    // Kept for this tab.
    await guest.goto(secure.page);
    await guest.until('document.getElementById("link-state").dataset.state === "connected"');
    await guest.evaluate('document.getElementById("sign-out").click()');
    await guest.until('!document.getElementById("sign-in")?.hidden');
    assert.deepEqual(guest.complaints, []);
  } finally {
    await trusting.stop();
    await secure.stop();
  }
});
