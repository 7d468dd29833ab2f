// The tests of tests/host_sdk/typescript that compare with the results of C++ (golden messages, a recording, damaged
// messages), unchanged in headless Chromium. usage: node --test chromium_answers_test.mjs; environment:
import assert from "node:assert/strict";
import { cpSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";

import { Browser } from "../dashboard/browser.mjs";
import { serveFolder } from "./static_server.mjs";

const tests = process.env.LIGHTWELL_TYPESCRIPT_TESTS;
const files = ["typescript_test.mjs", "cube_map_test.mjs", "estimate_test.mjs", "planes_test.mjs"];
const replaced = ["node:assert/strict", "node:fs", "node:test", "node:url"];
const folder = mkdtempSync(join(tmpdir(), "lightwell-answers-"));
let server;
let browser;

before(async () => {
  cpSync(dirname(process.env.LIGHTWELL_MODULE), join(folder, "dist"), { recursive: true });
  cpSync(process.env.LIGHTWELL_ANSWERS, join(folder, "answers"), { recursive: true });
  for (const name of files) cpSync(join(tests, name), join(folder, name));
  cpSync(fileURLToPath(new URL("node_in_page.mjs", import.meta.url)), join(folder, "node_in_page.mjs"));
  const imports = Object.fromEntries(replaced.map((name) => [name, "/node_in_page.mjs"]));
  writeFileSync(join(folder, "tests.html"), `<script type="importmap">${JSON.stringify({ imports })}</script>
    <script type="module">globalThis.resultsOf = (await import("/node_in_page.mjs")).resultsOf;</script>`);
  server = await serveFolder(folder);
  browser = await Browser.start();
});
after(async () => {
  await browser?.stop();
  await server?.stop();
  rmSync(folder, { recursive: true, force: true });
});

for (const file of files)
  test(`${file} in Chromium`, async () => {
    const page = await browser.newPage();
    await page.goto(`${server.origin}/tests.html`);
    await page.until("globalThis.resultsOf");
    const results = await page.evaluate(`resultsOf("/${file}")`);
    assert.deepEqual(results.filter(({ error }) => error), []);
    const written = readFileSync(join(tests, file), "utf8").match(/^test\(/gm);
    assert.equal(results.length, written.length, "every test was run");
    await page.close();
  });

test("a test that fails in the page is seen to fail", async () => {
  writeFileSync(join(folder, "failing.mjs"),
    'import assert from "node:assert/strict"; import { test } from "node:test";\n' +
    'test("equal", () => assert.equal(1, 2)); test("deep", () => assert.deepEqual([1, { a: 0 }], [1, { a: -0 }]));\n' +
    'test("throws", () => assert.throws(() => {}, /x/));\n' +
    'test("passes", () => assert.deepEqual(new Set([1]), new Set([1])));');
  const page = await browser.newPage();
  await page.goto(`${server.origin}/tests.html`);
  await page.until("globalThis.resultsOf");
  const results = await page.evaluate('resultsOf("/failing.mjs")');
  assert.deepEqual(results.filter(({ error }) => error).map(({ name }) => name), ["equal", "deep", "throws"]);
});
