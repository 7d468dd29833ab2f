// Latency of a native client and of a browser in one table: from mid-exposure to reception, ms.
// usage: cmake --build build/dev --target web_latency; environment: that of dashboard_test.mjs
import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

import { Browser, until } from "./browser.mjs";
import { Daemon, writePanorama } from "./daemon.mjs";

const { WebSocket } = createRequire(import.meta.url)(process.env.LIGHTWELL_NODE_WS);
const seconds = 10;

/** Also runs in the page, by its source text. */
async function latencies({ connect }, address, options, ms) {
  const probe = await connect(address, options);
  // The clock map becomes better with the first round trips.
  await new Promise((resume) => setTimeout(resume, 1000));
  const out = [];
  probe.on("descriptor", ({ midExposureNs, receivedNs }) => out.push(Number(receivedNs - midExposureNs) / 1e6));
  await new Promise((resume) => setTimeout(resume, ms));
  const uncertainty = Number(probe.info().clockUncertaintyNs) / 1e6;
  probe.close();
  return { out, uncertainty };
}

function print(name, count, p50, p99, uncertainty) {
  console.log(`| ${[name, count, ...[p50, p99, uncertainty].map((ms) => ms.toFixed(2))].join(" | ")} |`);
}

function row(name, { out, uncertainty }) {
  const sorted = [...out].sort((a, b) => a - b);
  const at = (share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
  print(name, out.length, at(0.5), at(0.99), uncertainty);
}

const folder = mkdtempSync(join(tmpdir(), "lightwell-latency-"));
const panorama = join(folder, "lamp.hdr");
writePanorama(panorama);
const daemon = await Daemon.start({ camera: `sim:${panorama}`, more: ["--frame-rate", "60"] });
const browser = await Browser.start();
try {
  console.log("| client | descriptors | p50, ms | p99, ms | clock uncertainty, ms |\n| --- | --- | --- | --- | --- |");
  for (const [name, address] of [["C++ SDK, gRPC", daemon.grpc], ["C++ SDK, WebSocket", daemon.address]]) {
    // The last line is the summary.
    const lines = execFileSync(process.env.LIGHTWELL_CLI, ["watch", address, "--seconds", String(seconds), "--json"],
                               { encoding: "utf8" });
    const { frames, latency_p50_ms: p50, latency_p99_ms: p99, clock_uncertainty_ms: u } =
      JSON.parse(lines.trim().split("\n").at(-1));
    print(name, frames, p50, p99, u);
  }
  const module = await import(pathToFileURL(process.env.LIGHTWELL_MODULE).href);
  row("TypeScript SDK, Node", await latencies(module, daemon.address, { WebSocket }, 1000 * seconds));
  const page = await browser.newPage();
  const measure = () => page.evaluate(`import("/sdk/lightwell.js").then((module) => (${latencies})(module, ` +
    `${JSON.stringify(daemon.address)}, {}, ${1000 * seconds}))`);
  await page.goto(`${daemon.page}/icon.svg`);
  row("TypeScript SDK, Chromium, an empty page", await measure());
  await page.goto(daemon.page);
  await page.until('document.getElementById("link-state").dataset.state === "connected"');
  // After the shaders are compiled.
  await until(async () => Number(await page.text("latency")) < 100, "the page is at rest", 60_000).catch(() => {});
  row("TypeScript SDK, Chromium, beside the dashboard (software WebGL)", await measure());
} finally {
  await browser.stop();
  await daemon.stop();
  rmSync(folder, { recursive: true, force: true });
}
