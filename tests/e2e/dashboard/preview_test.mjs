// The camera's preview in headless Chromium with a real lightwelld.
// usage: node --test preview_test.mjs; environment: that of dashboard_test.mjs
import assert from "node:assert/strict";
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { Browser, until } from "./browser.mjs";
import { Daemon, writePanorama } from "./daemon.mjs";

const pictures = process.env.LIGHTWELL_SCREENSHOTS;
mkdirSync(pictures, { recursive: true });
const folder = mkdtempSync(join(tmpdir(), "lightwell-preview-"));
const panorama = join(folder, "lamp.hdr");
// More than one percent of the picture, so that its radiance, and not that of the sky, is shown as white.
writePanorama(panorama, 0.35);
const config = join(folder, "probe.textproto");
writeFileSync(config, "images: IMAGE_RECIPIENTS_ALL_CLIENTS\n");

let daemon;
let browser;
let page;
before(async () => {
  // A stitched camera, whose picture is the panorama, turned by 6° a second: in the seconds for which a
  // picture is shown on a busy machine the lamp moves by less than the tolerance of the test.
  daemon = await Daemon.start({
    camera: `sim:${panorama}?rig=equirect&yaw_rate=6deg/s&frames=900`, size: "320x160", more: ["--config", config],
  });
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

/** Column (0 to 1) of the brightest pixels of the picture that the page shows, its size, and which picture it is; null:
 *  ask again. */
const shown = () => page.evaluate(`(async () => {
  const picture = document.getElementById("preview-picture");
  // Rejected where the page sets the next picture meanwhile.
  if (!(await picture.decode().then(() => true, () => false))) return null;
  const copy = document.createElement("canvas");
  [copy.width, copy.height] = [picture.naturalWidth, picture.naturalHeight];
  const context = copy.getContext("2d");
  context.drawImage(picture, 0, 0);
  const { data } = context.getImageData(0, 0, copy.width, copy.height);
  let [sine, cosine] = [0, 0];
  for (let i = 0; i < data.length; i += 4)
    if (Math.min(data[i], data[i + 1], data[i + 2]) > 235) {
      const phi = 2 * Math.PI * ((i / 4) % copy.width) / copy.width;
      sine += Math.sin(phi);
      cosine += Math.cos(phi);
    }
  return { column: (Math.atan2(sine, cosine) / (2 * Math.PI) + 1) % 1, width: copy.width, height: copy.height,
     source: picture.src, light: Number(document.querySelectorAll("#lights tbody td")[1]?.textContent.slice(0, -1)) };
})()`);

const isShown = '(picture => !picture.hidden && picture.complete && picture.naturalWidth > 0)' +
  '(document.getElementById("preview-picture"))';

test("nothing is fetched before a person asks", async () => {
  await page.until('Number(document.getElementById("rate").textContent) > 5');
  assert.equal(await page.evaluate(
    'performance.getEntriesByType("resource").filter(({ name }) => name.endsWith("preview.jpg")).length'), 0);
  assert.equal(await page.evaluate(isShown), false);
});

test("the picture is shown, and a lamp that moves in the scene moves in it", async () => {
  await page.evaluate('document.getElementById("preview-toggle").click()');
  await page.until(isShown);
  const first = await until(shown, "a picture");
  assert.deepEqual([first.width, first.height], [320, 160]);
  const columns = [];
  let source;
  let agreed = 0;
  await until(async () => {
    const now = await shown();
    if (now !== null && now.source !== source) {
      source = now.source;
      columns.push(now.column);
      // The page's own measurement of the lamp, which is younger than the picture.
      const expected = (now.light / 360 + 0.5 + 1) % 1;
      const turned = Math.abs(((now.column - expected + 1.5) % 1) - 0.5);
      if (turned < 50 / 360) ++agreed;
    }
    const moved = columns.map((v) => Math.abs(((v - columns[0] + 1.5) % 1) - 0.5));
    return columns.length > 3 && agreed > 2 && Math.max(...moved) > 40 / 360;
  }, "pictures with the lamp where it is measured, which moves");
  assert.deepEqual(page.complaints, []);
});

test("at most one picture a second is fetched", async () => {
  const fetched = () => page.evaluate(
    'performance.getEntriesByType("resource").filter(({ name }) => name.endsWith("preview.jpg")).length');
  const before = await fetched();
  await new Promise((resume) => setTimeout(resume, 4000));
  const count = (await fetched()) - before;
  assert.ok(count >= 2 && count <= 5, `${count} in four seconds`);
});

test("it fits desktop and phone", async () => {
  for (const [name, width, height, options] of [["preview_desktop", 1280, 900, {}],
                                                ["preview_phone", 390, 844, { mobile: true, scale: 2 }]]) {
    await page.view(width, height, options);
    await page.evaluate('document.getElementById("preview-title").scrollIntoView()');
    await new Promise((resume) => setTimeout(resume, 1500));
    assert.equal(await page.evaluate("document.documentElement.scrollWidth"), width, name);
    await page.screenshot(join(pictures, `${name}.png`));
  }
  await page.view(1280, 900);
});

test("hiding the picture stops the requests", async () => {
  await page.evaluate('document.getElementById("preview-toggle").click()');
  assert.equal(await page.evaluate(isShown), false);
  await new Promise((resume) => setTimeout(resume, 1500));
  const fetched = () => page.evaluate(
    'performance.getEntriesByType("resource").filter(({ name }) => name.endsWith("preview.jpg")).length');
  const before = await fetched();
  await new Promise((resume) => setTimeout(resume, 2500));
  assert.equal(await fetched(), before);
});
