// The npm package, installed from its tarball into an empty folder, with the examples of its README and a real
// lightwelld. usage: node --test npm_package_test.mjs; environment: that of package.mjs, ../dashboard/browser.mjs and
// ../dashboard/daemon.mjs, LIGHTWELL_LICENSE (the project's)
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { cpSync, existsSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";

import { Browser, until } from "../dashboard/browser.mjs";
import { Daemon, writePanorama } from "../dashboard/daemon.mjs";
import { copySource, installInto, pack, runNpm } from "./package.mjs";
import { serveFolder } from "./static_server.mjs";

const examples = join(process.env.LIGHTWELL_TYPESCRIPT, "examples");
const folder = mkdtempSync(join(tmpdir(), "lightwell-npm-"));
const panorama = join(folder, "lamp.hdr");
let packed;
let application;
let server;
let daemon;

before(async () => {
  packed = pack(folder);
  application = installInto(join(folder, "application"), packed.tarball);
  for (const name of ["light.html", "light.mjs"]) cpSync(join(examples, name), join(application, name));
  server = await serveFolder(application);
  writePanorama(panorama);
  const config = join(folder, "probe.textproto");
  writeFileSync(config, `web { allowed_origins: "${server.origin}" }\n`);
  daemon = await Daemon.start({ camera: `sim:${panorama}?lamp_switch=1s`, more: ["--config", config] });
});
after(async () => {
  await daemon?.stop();
  await server?.stop();
  rmSync(folder, { recursive: true, force: true });
});

test("the tarball has the compiled module with its types, the README and the licence, and nothing else", () => {
  const others = packed.files.filter((path) => !/^dist\/([a-z_]+\/)?[a-z_0-9]+\.(js|d\.ts)$/.test(path));
  assert.deepEqual(others.sort(), ["LICENSE", "README.md", "package.json"]);
  assert.ok(packed.files.includes("dist/lightwell.js") && packed.files.includes("dist/lightwell.d.ts"));
  assert.equal(readFileSync(join(application, "node_modules/lightwell/LICENSE"), "utf8"),
               readFileSync(process.env.LIGHTWELL_LICENSE, "utf8"));
});

test("nothing but the package is installed", () => {
  const installed = readdirSync(join(application, "node_modules")).filter((name) => !name.startsWith("."));
  assert.deepEqual(installed, ["lightwell"]);
  const { dependencies, peerDependencies, scripts } =
    JSON.parse(readFileSync(join(application, "node_modules/lightwell/package.json"), "utf8"));
  assert.deepEqual([dependencies, peerDependencies, scripts.install, scripts.postinstall],
                   [undefined, undefined, undefined, undefined]);
});

test("eight lines for Node print the light of a simulated probe", () => {
  assert.ok(readFileSync(join(examples, "light.mjs"), "utf8").trimEnd().split("\n").length <= 8);
  const flags = typeof WebSocket === "undefined" ? ["--experimental-websocket"] : [];
  // The lamp is lit every other second: until a run sees it.
  for (let attempt = 0; ; ++attempt) {
    const text = execFileSync(process.execPath, [...flags, "light.mjs", daemon.address],
                              { cwd: application, encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] });
    assert.match(text, /^valid: irradiance from above [\d.]+,[\d.]+,[\d.]+, error at most 0\.\d+\n/);
    const light = /^light (\S+):/m.exec(text)?.[1].split(",").map(Number);
    if (!light && attempt < 20) continue;
    // writePanorama(): azimuth 40°, elevation 30°.
    [0.557, 0.5, -0.663].forEach((v, k) => assert.ok(Math.abs(light[k] - v) < 0.02, `${light}`));
    break;
  }
});

test("a page of twenty lines shows the light, and the lamp that is switched", async () => {
  assert.ok(readFileSync(join(examples, "light.html"), "utf8").trimEnd().split("\n").length <= 20);
  const browser = await Browser.start();
  try {
    const page = await browser.newPage();
    await page.goto(`${server.origin}/light.html?probe=${daemon.address}`);
    /** Sum of the channels of a place of the ball, 0 to 765, and the text of the same frame. */
    const shown = () => page.evaluate(`(() => {
      const context = document.getElementById("ball").getContext("2d");
      const sum = (x, y) => context.getImageData(x, y, 1, 1).data.slice(0, 3).reduce((a, b) => a + b, 0);
      return { right: sum(30, 11), left: sum(2, 11), text: document.getElementById("text").textContent };
    })()`);
    const lit = await until(async () => {
      const now = await shown();
      return /^valid, 1 lights, irradiance from above: [1-9]/.test(now.text) ? now : null;
    }, "the lamp is shown");
    // The lamp is on the right. As sRGB code values the ratio is half of that of the irradiances.
    assert.ok(lit.right > 1.05 * lit.left, JSON.stringify(lit));
    const dark = await until(async () => {
      const now = await shown();
      return /^valid, 0 lights/.test(now.text) ? now : null;
    }, "the lamp is switched off");
    assert.ok(Math.abs(dark.right / dark.left - 1) < 0.03, JSON.stringify({ lit, dark }));
    assert.deepEqual(page.complaints.filter((text) => !/favicon|getImageData/.test(text)), []);
  } finally {
    await browser.stop();
  }
});

test("its types serve a program in TypeScript", () => {
  const compile = (text, name, ...options) => {
    writeFileSync(join(application, name), text);
    try {
      execFileSync(process.env.LIGHTWELL_TSC, ["--strict", "--noEmit", "--target", "es2020", ...options, name],
                   { cwd: application, encoding: "utf8" });
      return "";
    } catch ({ stdout }) {
      return stdout;
    }
  };
  const good = `import { connect, type Lighting } from "lightwell";
    export async function up(address: string): Promise<number> {
      const light: Lighting = (await connect(address)).latest();
      return light.irradiance([0, 1, 0]).value[0];
    }`;
  assert.equal(compile(good, "program.mts", "--module", "node16"), "");
  const webXr = `import { provideLightEstimation, type LightEstimation } from "lightwell/webxr";
    export const start = (address: string): Promise<LightEstimation> => provideLightEstimation(address, { scale: 2 });`;
  assert.equal(compile(webXr, "webxr.mts", "--module", "node16"), "");
  assert.equal(compile(webXr, "webxr.ts", "--module", "es2020", "--moduleResolution", "node"), "");
  assert.equal(compile(good, "program.ts", "--module", "es2020", "--moduleResolution", "node"), "");
  assert.match(compile(good.replace("[0, 1, 0]", '"up"'), "program.mts", "--module", "node16"), /TS2345.*Vec3/);
});

test("it installs from a folder, too", async () => {
  const source = join(folder, "checkout");
  copySource(source);
  runNpm(source, "run", "build");
  const other = installInto(join(folder, "other"), source);
  const module = join(other, "node_modules/lightwell/dist/lightwell.js");
  assert.ok(existsSync(module));
  assert.equal(typeof (await import(pathToFileURL(module).href)).connect, "function");
});
