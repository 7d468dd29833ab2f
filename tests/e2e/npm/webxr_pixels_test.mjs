// WebXR's light estimation from a real lightwelld, in headless Chromium with npm's three.js and an emulated device:
// pixels of balls lit through XREstimatedLight. usage: node --test webxr_pixels_test.mjs; environment: that of
// webxr_page.mjs
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { until } from "../dashboard/browser.mjs";
import { WebXrPages } from "./webxr_page.mjs";

/** Required: pixels within 2 % of those of the same scene lit by toThree(). Code values of 8 bits alone make 0.3 %. */
const limit = 0.02;

let pages;
before(async () => (pages = await WebXrPages.start()));
after(() => pages?.stop());

/** A scene in a new page, compared `times` times. */
async function compareAll(page, times) {
  const found = [];
  for (let i = 0; i < times; ++i) found.push(await page.evaluate("scene.compare()"));
  return found;
}

function report(what, found, ball = "matt") {
  const [rms, worst] = ["rms", "worst"].map((kind) => Math.max(...found.map((one) => one[ball][kind])));
  console.log(`# ${what}: RMS ${(100 * rms).toFixed(2)} %, worst pixel ${(100 * worst).toFixed(2)} % of the brightest`);
  assert.ok(rms <= limit && worst <= limit, `${rms} ${worst}`);
  found.forEach((one) => assert.ok(one[ball].pixels > 1000 && one[ball].brightest > 0.2, JSON.stringify(one)));
}

test("a lamp that is switched lights the ball as toThree() does", async () => {
  const daemon = await pages.daemon("?lamp_switch=1s");
  const page = await pages.open(daemon, { scale: 0.2 });
  const found = [];
  await until(async () => {
    found.push(...(await compareAll(page, 5)));
    const states = new Set(found.map(({ lights }) => lights));
    return states.size === 2 && found.length >= 60;
  }, "both states of the lamp", 120_000);
  report("lamp switched", found);
  await page.close();
});

test("a probe that turns, and a probe that hangs turned in the session's space", async () => {
  const daemon = await pages.daemon("?yaw_rate=60");
  const page = await pages.open(daemon, { scale: 0.2 });
  const found = await compareAll(page, 40);
  const azimuths = found.map(({ direction }) => Math.atan2(direction[0], -direction[2]));
  assert.ok(Math.max(...azimuths) - Math.min(...azimuths) > 0.3, `${azimuths}`);
  report("probe turns", found);
  for (const rotation of [[0, Math.SQRT1_2, 0, Math.SQRT1_2], [0.5, -0.5, 0.5, 0.5], [0.36, 0.48, -0.48, 0.64]]) {
    await page.evaluate(`scene.estimation.pose = { rotation: ${JSON.stringify(rotation)}, translation: [1, 2, 3] }`);
    await compareAll(page, 3);
    report(`hung as ${rotation}`, await compareAll(page, 10));
  }
  await page.close();
});

test("a mirror reflects the environment map", async () => {
  const daemon = await pages.daemon("", ["estimator { panorama { environment_edge: 64 } }"]);
  const page = await pages.open(daemon, { scale: 0.2 }, "mirror");
  // Four pictures in succession: the cube map follows a turn after some frames. A busy machine may be too slow for the
  // maps of a second: then the mirror is black in both scenes, and its error is no number.
  const shown = async (what) => {
    let found = [];
    await until(async () => {
      const one = await page.evaluate("scene.compare()");
      if (one.mirror.pixels <= 1000) return false;
      found = one.mirror.rms <= limit && one.mirror.worst <= limit ? [...found, one] : [];
      return found.length >= 4;
    }, what, 120_000);
    report(what, found, "mirror");
  };
  await shown("mirror");
  writeFileSync(join(pages.screenshots, "xr_and_three.png"),
                Buffer.from((await page.evaluate("scene.picture()")).split(",")[1], "base64"));
  // Half a turn: a cube map whose axes were those of the probe would show the lamp's side behind.
  await page.evaluate("scene.estimation.pose = { rotation: [0, 1, 0, 0], translation: [0, 0, 0] }");
  await shown("mirror, turned");
  await page.close();
});

test("the page of the README, of sixty lines at most, shows the same as toThree()", async () => {
  const text = readFileSync(join(process.env.LIGHTWELL_TYPESCRIPT, "examples/webxr.html"), "utf8");
  assert.ok(text.trimEnd().split("\n").length <= 60);
  const daemon = await pages.daemon("");
  const example = await pages.browser.newPage();
  await example.view(800, 600);
  await example.goto(`${pages.origin}/webxr.html?probe=${daemon.address}`);
  await example.until('document.getElementById("text").textContent === "ready"');
  await example.evaluate('document.getElementById("enter").click()');
  // On a busy machine the light or its reflection may come after the first pictures.
  const files = [1, 2, 3, 4].map((n) => join(pages.screenshots, `example_${n}.png`));
  for (const file of files) {
    await new Promise((resume) => setTimeout(resume, 3000));
    await example.screenshot(file);
  }
  await example.close();
  const page = await pages.open(daemon, { scale: 0.3 }, "mirror", [800, 600]);
  let found;
  for (const file of files) {
    found = await page.evaluate(`scene.compareScreenshot(${JSON.stringify(pages.dataUrl(file))})`);
    if (found.matt.rms <= limit && found.mirror.rms <= limit) break;
  }
  // No limit of the worst pixel: the page's antialiasing smooths the edges of highlights.
  for (const [name, { rms, pixels }] of Object.entries(found)) {
    console.log(`# the README's page, ${name}: RMS ${(100 * rms).toFixed(2)} %`);
    assert.ok(rms <= limit && pixels > 5000, `${name} ${rms} ${pixels}`);
  }
  await page.close();
});
