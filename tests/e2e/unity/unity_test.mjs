// The managed client of bindings/unity under Mono: with a real lightwelld, and with a probe that sends what it should
// not. usage: node --test unity_test.mjs; environment: that of ../dashboard/daemon.mjs and
// ../../host_sdk/typescript/fake_probe.mjs, LIGHTWELL_MONO, LIGHTWELL_PROGRAMS (the folder of PrintLight.exe and
// ManagedLink.exe)
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { FakeProbe, descriptor } from "../../host_sdk/typescript/fake_probe.mjs";
import { until } from "../dashboard/browser.mjs";
import { Daemon, pairedToken, writePanorama } from "../dashboard/daemon.mjs";

const { LIGHTWELL_MONO: mono, LIGHTWELL_PROGRAMS: programs } = process.env;
const folder = mkdtempSync(join(tmpdir(), "lightwell-unity-"));
/** No native library can be found, and Mono trusts what is below this home. */
const env = { PATH: process.env.PATH, HOME: folder };
/** writePanorama(): azimuth 40°, elevation 30°. */
const lamp = [0.557, 0.5, -0.663];
const started = [];
let daemon;

before(async () => {
  writePanorama(join(folder, "lamp.hdr"));
  daemon = await Daemon.start({ camera: `sim:${join(folder, "lamp.hdr")}?lamp_switch=1s` });
});
after(async () => {
  // Of tests that failed.
  for (const { process: child } of started) child.kill();
  await daemon?.stop();
  rmSync(folder, { recursive: true, force: true });
});

/** The output of a program that matches `complete`. Mono 6.8 now and then waits for up to a minute for an idle worker
 *  of its thread pool when a program ends: such a program is killed when its output is complete. */
async function outputOf(program, args, complete) {
  const child = spawn(mono, [join(programs, program), ...args], { env, stdio: ["ignore", "pipe", "inherit"] });
  let text = "";
  let timer;
  child.stdout.on("data", (more) => {
    text += more;
    if (complete.test(text)) timer ??= setTimeout(() => child.kill("SIGKILL"), 1000);
  });
  const limit = setTimeout(() => child.kill("SIGKILL"), 60_000);
  await new Promise((done) => child.once("close", done));
  clearTimeout(limit);
  clearTimeout(timer);
  assert.match(text, complete);
  return text;
}

/** ManagedLink.exe, whose lines are read. */
class Program {
  lines = [];

  constructor(...args) {
    this.process = spawn(mono, [join(programs, "ManagedLink.exe"), ...args], { env, stdio: ["pipe", "pipe",
        "inherit"] });
    started.push(this);
    let text = "";
    this.process.stdout.on("data", (more) => {
      const parts = (text + more).split("\n");
      text = parts.pop();
      this.lines.push(...parts);
    });
    this.ended = new Promise((done) => this.process.once("close", done));
  }

  /** The newest line that matches, from now on. */
  line(pattern, what = String(pattern)) {
    const from = this.lines.length;
    return until(() => this.lines.slice(from).map((line) => pattern.exec(line)).find((found) => found), what);
  }

  /** The last line. The program has said it after 5 s at most. */
  async end() {
    const limit = setTimeout(() => this.process.kill("SIGKILL"), 10_000);
    await this.ended;
    clearTimeout(limit);
    return this.lines.at(-1);
  }

  stop() {
    this.process.stdin.end();
    return this.end();
  }
}

/** What ManagedLink.exe prints if it cannot connect. */
const failure = (...args) => new Program("link", ...args).end();

test("a program in C# prints the light of a simulated probe without any native library", async () => {
  await until(async () => {
    const text = await outputOf("PrintLight.exe", [daemon.address], /\n/);
    assert.match(text, /^Valid: irradiance from above [1-9]\S* [1-9]\S* [1-9]\S*, error at most \d/);
    const found = /^light (\S+) (\S+) (\S+)$/m.exec(text)?.slice(1).map(Number);
    if (!found) return false; // The lamp is off.
    found.forEach((v, k) => assert.ok(Math.abs(v - lamp[k]) < 0.02, text));
    return true;
  }, "the lamp is printed");
});

test("the sample component sets Unity's sun and ambient light, in Unity's axes", async () => {
  const program = new Program("component", daemon.address, "");
  const [, x, y, z, intensity, ambient] =
    await program.line(/^forward (\S+) (\S+) (\S+) intensity (0\.[3-9]\S*) ambient (\S+)/, "the sun shines");
  [-lamp[0], -lamp[1], lamp[2]].forEach((v, k) => assert.ok(Math.abs(Number([x, y, z][k]) - v) < 0.02,
      `${x} ${y} ${z}`));
  // Half of pi sin²(0.09) 90, over pi; and half of the mean of the room's red, 120 and 130 times 2/256.
  assert.ok(Math.abs(intensity - 0.364) < 0.02, intensity);
  assert.ok(Math.abs(ambient - 0.49) < 0.03, ambient);
  await program.line(/^forward .* intensity 0\.0000 /, "the sun is switched off");
  await program.stop();
});

test("the sample provider gives AR Foundation the light of a probe", async () => {
  const text = await outputOf("ArFoundationTest.exe", [process.env.LIGHTWELL_ANSWERS, daemon.address], / wrong\n/);
  assert.match(text, /^lumens \d/m);
  assert.match(text, / 0 wrong$/m);
});

test("the sample node gives Godot the light of a probe", async () => {
  const text = await outputOf("GodotTest.exe", [process.env.LIGHTWELL_ANSWERS, daemon.address], / wrong\n/);
  assert.match(text, /^sky \d/m);
  assert.match(text, / 0 wrong$/m);
});

test("over TLS with a token and a certificate that this machine trusts", async () => {
  const run = (...args) => execFileSync("openssl", args, { cwd: folder, stdio: ["ignore", "pipe", "ignore"],
      encoding: "utf8" });
  const key = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes"];
  writeFileSync(join(folder, "names"), "subjectAltName=DNS:localhost\n");
  run("req", "-x509", ...key, "-keyout", "ca.key", "-out", "ca.pem", "-days", "2", "-subj", "/CN=Owner");
  run("req", ...key, "-keyout", "probe.key", "-out", "probe.csr", "-subj", "/CN=localhost");
  run("x509", "-req", "-in", "probe.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial", "-days", "2",
      "-extfile", "names", "-out", "probe.pem");
  const config = join(folder, "probe.textproto");
  writeFileSync(config, 'web { security: LINK_SECURITY_TLS certificate: "probe.pem" key: "probe.key" }\n');
  const keys = join(folder, "keys");
  const token = await pairedToken(folder, keys);
  const secure = await Daemon.start({
    camera: `sim:${join(folder, "lamp.hdr")}`, more: ["--config", config, "--security", "tls", "--keys", keys],
  });
  try {
    const address = secure.address.replace("127.0.0.1", "localhost");
    assert.match(await failure(address, token), /^failed Unavailable no answer within 2000 ms .*CERTIFICATE/);
    const trusted = join(folder, ".config/.mono/new-certs/Trust");
    mkdirSync(trusted, { recursive: true });
    run("x509", "-in", "ca.pem", "-out", join(trusted, `${run("x509", "-hash", "-noout", "-in", "ca.pem").trim()}.0`));
    const program = new Program("link", address, token);
    await program.line(/^Connected Valid received \d+/);
    assert.equal(await program.stop(), "closed");
    for (const wrong of [[`${token}x`], []])
      assert.match(await failure(address, ...wrong),
          /^failed FailedPrecondition the probe refused this client: not auth/);
    // The certificate is not for this name.
    assert.match(await failure(secure.address, token), /^failed Unavailable/);
  } finally {
    await secure.stop();
  }
});

test("no probe and wrong addresses", async () => {
  assert.match(await failure("ws://127.0.0.1:1"), /^failed Unavailable no answer within 2000 ms \(no connection: /);
  assert.match(await failure("grpc://127.0.0.1"), /^failed InvalidArgument 'grpc:.* write wss:\/\/HOST/);
  assert.match(await failure("ws://127.0.0.1:70000"), /^failed InvalidArgument .* the port must be a number from 1 to/);
  assert.match(await failure("ws://192.0.2.1", "secret"), /^failed InvalidArgument .* a token is sent only over TLS/);
});

test("what is no descriptor is counted and changes nothing", async (t) => {
  const probe = await FakeProbe.start();
  t.after(() => probe.stop());
  const send = (bytes) => probe.clients.forEach((client) => client.send(bytes));
  const program = new Program("link", probe.address);
  await program.line(/^Connected None/);
  assert.equal(program.lines[0], "name attic");
  send(descriptor(7));
  const [, up] = await program.line(/received 1 .* up (\S+)/);
  send(Buffer.alloc(70_000, 1));
  send(Buffer.from([0x32, 0xff, 0xff]));
  send(Buffer.from([0x0d, 0xff]));
  send("text");
  send(descriptor(6));
  const [, afterwards] = await program.line(/received 1 oversized 1 undecodable 3 replayed 1 reconnects 0 up (\S+) /);
  assert.equal(afterwards, up, program.lines.filter((line) => /received 1 /.test(line)).slice(0, 3).join("\n"));
  send(descriptor(8));
  await program.line(/received 2 oversized 1 undecodable 3/);
  assert.equal(await program.stop(), "closed");
  await until(() => probe.clients.size === 0, "the connection is closed");
});

test("a lost probe: the light becomes stale, and fresh when the probe is back", async (t) => {
  const probe = await FakeProbe.start();
  t.after(() => probe.stop());
  const program = new Program("link", probe.address);
  await program.line(/^Connected None/);
  probe.clients.forEach((client) => client.send(descriptor(1, probe.clockNow())));
  await program.line(/ Valid received 1 /);
  const { port } = probe;
  await probe.stop();
  await program.line(/^(Waiting|Connecting) Stale received 1 /);
  const again = await FakeProbe.start(port);
  t.after(() => again.stop());
  await program.line(/^Connected Stale received 1 .* reconnects 1 /);
  again.clients.forEach((client) => client.send(descriptor(1, again.clockNow())));
  await program.line(/^Connected Valid received 2 /);
  // A probe that says nothing any more counts as lost.
  again.answers = false;
  await program.line(/error no data from the probe within SilenceLimitMs/);
  await program.stop();
});
