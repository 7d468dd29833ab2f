// Headless Chromium, driven by the DevTools protocol. Environment: LIGHTWELL_CHROMIUM, LIGHTWELL_NODE_WS.
import { spawn } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";

const { WebSocket } = createRequire(import.meta.url)(process.env.LIGHTWELL_NODE_WS);

/** Waits until the condition, which may be asynchronous, holds. Throws after `limitMs`. */
export async function until(condition, what, limitMs = 30_000) {
  for (const end = performance.now() + limitMs; performance.now() < end;) {
    const value = await condition();
    if (value) return value;
    await new Promise((resume) => setTimeout(resume, 20));
  }
  throw new Error(`not within ${limitMs / 1000} s: ${what}`);
}

class Connection {
  constructor(socket) {
    this.socket = socket;
    this.next = 1;
    this.waiting = new Map();
    this.onEvent = () => {};
    socket.on("message", (text) => {
      const message = JSON.parse(text);
      if (message.id === undefined) return this.onEvent(message);
      const { resolve, reject } = this.waiting.get(message.id);
      this.waiting.delete(message.id);
      if (message.error) reject(new Error(message.error.message));
      else resolve(message.result);
    });
  }

  static async open(url) {
    const socket = new WebSocket(url, { perMessageDeflate: false });
    await new Promise((resolve, reject) => socket.on("open", resolve).on("error", reject));
    return new Connection(socket);
  }

  send(method, params = {}) {
    return new Promise((resolve, reject) => {
      this.waiting.set(this.next, { resolve, reject });
      this.socket.send(JSON.stringify({ id: this.next++, method, params }));
    });
  }
}

/** One tab. */
export class Page {
  /** What the page or the browser wrote to the console as an error or a warning, and exceptions. */
  complaints = [];

  constructor(connection) {
    this.connection = connection;
    connection.onEvent = ({ method, params }) => {
      if (method === "Runtime.exceptionThrown")
        this.complaints.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
      if (method === "Log.entryAdded" && ["error", "warning"].includes(params.entry.level))
        this.complaints.push(`${params.entry.text} ${params.entry.url ?? ""}`);
      if (method === "Runtime.consoleAPICalled" && ["error", "warning", "assert"].includes(params.type))
        this.complaints.push(params.args.map(({ value, description }) => value ?? description).join(" "));
    };
  }

  async goto(url) {
    await this.connection.send("Page.navigate", { url });
    await until(() => this.evaluate('document.readyState === "complete"'), `${url} is loaded`);
  }

  /** Value of an expression in the page; promises are awaited. */
  async evaluate(expression) {
    const { result, exceptionDetails } = await this.connection.send("Runtime.evaluate",
      { expression, awaitPromise: true, returnByValue: true });
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  }

  text(id) {
    return this.evaluate(`document.getElementById(${JSON.stringify(id)}).textContent`);
  }

  until(expression, what = expression) {
    return until(() => this.evaluate(expression), what);
  }

  async view(width, height, { scheme = "light", mobile = false, scale = 1 } = {}) {
    await this.connection.send("Emulation.setDeviceMetricsOverride",
      { width, height, deviceScaleFactor: scale, mobile });
    await this.connection.send("Emulation.setEmulatedMedia",
      { features: [{ name: "prefers-color-scheme", value: scheme }] });
  }

  /** A picture of the whole page, as PNG. */
  async screenshot(file) {
    await this.evaluate("scrollTo(0, 0)");
    const { cssContentSize: { width, height } } = await this.connection.send("Page.getLayoutMetrics");
    const { data } = await this.connection.send("Page.captureScreenshot",
      { format: "png", captureBeyondViewport: true, clip: { x: 0, y: 0, width, height, scale: 1 } });
    writeFileSync(file, Buffer.from(data, "base64"));
  }

  /** What the view shows, as JPEG. */
  async picture(file) {
    const { data } = await this.connection.send("Page.captureScreenshot", { format: "jpeg", quality: 85 });
    writeFileSync(file, Buffer.from(data, "base64"));
  }

  async key(key, text) {
    for (const type of ["keyDown", "keyUp"])
      await this.connection.send("Input.dispatchKeyEvent", {
        type, key, code: key, text: type === "keyDown" ? text : undefined,
        windowsVirtualKeyCode: { Tab: 9, Enter: 13, " ": 32, ArrowRight: 39 }[key],
      });
  }

  type(text) {
    return this.connection.send("Input.insertText", { text });
  }

  async close() {
    await this.connection.send("Page.close");
    this.connection.socket.close();
  }
}

export class Browser {
  /** options: further command line options of Chromium. */
  static async start(options = []) {
    const browser = new Browser();
    browser.profile = mkdtempSync(join(tmpdir(), "lightwell-chromium-"));
    // WebGL by software, because test machines have no GPU. --no-sandbox, because tests may run as root.
    browser.process = spawn(process.env.LIGHTWELL_CHROMIUM, [
      "--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars",
      "--remote-debugging-port=0", `--user-data-dir=${browser.profile}`, "--no-first-run", "--disable-extensions",
      "--disable-background-networking", "--disable-component-update", ...options, "about:blank",
    ], { stdio: "ignore" });
    const portFile = join(browser.profile, "DevToolsActivePort");
    browser.port = await until(() => existsSync(portFile) && /^\d+\n/.exec(readFileSync(portFile, "utf8"))?.[0].trim(),
                               "Chromium has opened its port");
    return browser;
  }

  async newPage() {
    const target = await (await fetch(`http://127.0.0.1:${this.port}/json/new?about:blank`, { method: "PUT" })).json();
    const page = new Page(await Connection.open(target.webSocketDebuggerUrl));
    for (const domain of ["Runtime", "Log", "Page"]) await page.connection.send(`${domain}.enable`);
    await page.view(1280, 900);
    return page;
  }

  async stop() {
    const ended = new Promise((done) => this.process.once("exit", done));
    this.process.kill();
    await ended;
    // Chromium's other processes may still write there for a moment.
    await until(() => {
      try {
        rmSync(this.profile, { recursive: true, force: true });
        return true;
      } catch {
        return false;
      }
    }, `${this.profile} is removed`).catch(() => {});
  }
}
