// lightwelld as a child process, and a panorama with one lamp for it. Environment: LIGHTWELLD, LIGHTWELL_CLI.
import { execFileSync, spawn } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";

import { until } from "./browser.mjs";

/** One lamp at azimuth 40°, elevation 30° above even light. At 5 % of its radiance, to which sim: switches it, it is
 *  no light any more, because its peak is below six times the mean. */
export function writePanorama(file, radiusRad = 0.09) {
  const [width, height] = [256, 128];
  const pixels = [];
  const [azimuth, elevation] = [(40 * Math.PI) / 180, Math.PI / 6];
  const lamp = [Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation), -Math.cos(elevation) * Math.cos(azimuth)];
  for (let j = 0; j < height; ++j)
    for (let i = 0; i < width; ++i) {
      const phi = 2 * Math.PI * ((i + 0.5) / width - 0.5);
      const theta = Math.PI * (0.5 - (j + 0.5) / height);
      const d = [Math.cos(theta) * Math.sin(phi), Math.sin(theta), -Math.cos(theta) * Math.cos(phi)];
      const inside = d[0] * lamp[0] + d[1] * lamp[1] + d[2] * lamp[2] > Math.cos(radiusRad);
      // RGBE of Radiance's .hdr: 0.5 to 1 times 2^(e - 128), here radiance 1, warm from below, and 90 in the lamp.
      pixels.push(...(inside ? [180, 170, 150, 135] : d[1] > 0 ? [120, 126, 140, 129] : [130, 110, 90, 129]));
    }
  writeFileSync(file, Buffer.concat([
    Buffer.from(`#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y ${height} +X ${width}\n`), Buffer.from(pixels)]));
}

export class Daemon {
  /** arguments: further ones. */
  static async start({ camera, size = "160x120", web = "127.0.0.1:0", more = [] }) {
    const daemon = new Daemon();
    daemon.arguments = ["--camera", camera, "--size", size, "--listen", "127.0.0.1:0", "--web", web, ...more];
    daemon.log = "";
    daemon.process = spawn(process.env.LIGHTWELLD, daemon.arguments, { stdio: ["ignore", "pipe", "pipe"] });
    for (const stream of [daemon.process.stdout, daemon.process.stderr])
      stream.on("data", (text) => (daemon.log += text));
    daemon.ended = new Promise((done) => daemon.process.once("exit", done));
    let over = false;
    daemon.ended.then(() => (over = true));
    const address = await until(() => over ? "over" : /listening on (wss?:\/\/\S+)/.exec(daemon.log)?.[1],
                                "lightwelld listens", 60_000);
    if (address === "over") throw new Error(`lightwelld ended: ${daemon.log}`);
    daemon.address = address;
    daemon.grpc = /listening on (grpcs?:\/\/\S+)/.exec(daemon.log)?.[1];
    daemon.page = address.replace(/^ws/, "http");
    daemon.port = Number(new URL(daemon.page).port);
    return daemon;
  }

  async stop(signal = "SIGTERM") {
    this.process.kill(signal);
    await this.ended;
  }
}

/** Pairs a client with the probe of this key folder, and returns its token. */
export async function pairedToken(folder, keys) {
  const pairing = spawn(process.env.LIGHTWELLD,
    ["--camera", "sim:none", "--pair", "--pair-listen", "127.0.0.1:0", "--keys", keys, "--security", "tls",
     "--listen", "127.0.0.1:7420"], { stdio: ["ignore", "pipe", "pipe"] });
  let log = "";
  for (const stream of [pairing.stdout, pairing.stderr]) stream.on("data", (text) => (log += text));
  const [, uri, code] = await until(() => /pairing on (\S+) for [^]*code (\d{6})/.exec(log), `a pairing code: ${log}`);
  const store = join(folder, "store");
  const out = execFileSync(process.env.LIGHTWELL_CLI, ["pair", uri, "--code", code, "--name", "browser"],
                           { env: { ...process.env, XDG_CONFIG_HOME: store, HOME: folder }, encoding: "utf8" });
  return readFileSync(join(/credentials\s+(\S+)/.exec(out)[1], "token"), "utf8").trim();
}
