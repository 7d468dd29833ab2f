// Pages with WebXR, lit by a real lightwelld. Environment: that of package.mjs, ../dashboard/browser.mjs and
// ../dashboard/daemon.mjs, LIGHTWELL_NPM_DIR (the folder of cmake/fetch_npm), LIGHTWELL_SCREENSHOTS (a folder)
import { cpSync, mkdirSync, mkdtempSync, readFileSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

import { Browser } from "../dashboard/browser.mjs";
import { Daemon, writePanorama } from "../dashboard/daemon.mjs";
import { installInto, pack } from "./package.mjs";
import { serveFolder } from "./static_server.mjs";

const here = dirname(fileURLToPath(import.meta.url));

export class WebXrPages {
  /** Installs the packages and starts a server and a browser. */
  static async start() {
    const it = new WebXrPages();
    it.screenshots = process.env.LIGHTWELL_SCREENSHOTS;
    mkdirSync(it.screenshots, { recursive: true });
    it.folder = mkdtempSync(join(tmpdir(), "lightwell-webxr-"));
    const application = installInto(join(it.folder, "application"), pack(it.folder).tarball);
    for (const name of ["three", "iwer"])
      symlinkSync(join(process.env.LIGHTWELL_NPM_DIR, name), join(application, "node_modules", name));
    cpSync(join(process.env.LIGHTWELL_TYPESCRIPT, "examples/webxr.html"), join(application, "webxr.html"));
    cpSync(join(here, "webxr.html"), join(application, "test.html"));
    for (const name of ["webxr_scenes.mjs", "webxr_calls.mjs"]) cpSync(join(here, name), join(application, name));
    it.server = await serveFolder(application);
    it.origin = it.server.origin;
    writePanorama(join(it.folder, "lamp.hdr"));
    it.daemons = [];
    it.browser = await Browser.start();
    return it;
  }

  /** A probe in a room with one lamp. parameters: of the simulated camera; config: further fields of its configuration,
   *  each a text; more: further arguments. */
  async daemon(parameters, config = [], more = []) {
    const file = join(this.folder, `probe${this.daemons.length}.textproto`);
    writeFileSync(file, [...config, `web { allowed_origins: "${this.origin}" }`, ""].join("\n"));
    const camera = `sim:${join(this.folder, "lamp.hdr")}${parameters}`;
    const daemon = await Daemon.start({ camera, more: ["--config", file, ...more] });
    this.daemons.push(daemon);
    return daemon;
  }

  /** A page of the tests, without a session. */
  async page() {
    const page = await this.browser.newPage();
    await page.goto(`${this.origin}/test.html`);
    await page.until("globalThis.api !== undefined");
    return page;
  }

  /** A page with `scene`, an XrScene. */
  async open(daemon, options, mirrors = "none", [width, height] = [400, 300]) {
    const page = await this.page();
    await page.view(width, height);
    await page.evaluate(`scenes.XrScene.start(${JSON.stringify(daemon.address)}, ${JSON.stringify(options)},
      "${mirrors}").then((it) => (globalThis.scene = it)).then(() => true)`);
    return page;
  }

  dataUrl(file) {
    return `data:image/png;base64,${readFileSync(file).toString("base64")}`;
  }

  async stop() {
    await this.browser?.stop();
    for (const daemon of this.daemons ?? []) await daemon.stop();
    await this.server?.stop();
    rmSync(this.folder, { recursive: true, force: true });
  }
}
