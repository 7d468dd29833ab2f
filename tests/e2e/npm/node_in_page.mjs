// What the tests of tests/host_sdk/typescript use of Node, for a page, so that they run unchanged in a browser: the
// page's import map names this module for node:assert/strict, node:fs, node:test and node:url. Assertions compare as
// Node's strict ones do, except that prototypes may differ.
class Bytes extends Uint8Array {
  static from(given) {
    const bytes = typeof given === "string" ? new TextEncoder().encode(given) : given;
    const made = new Bytes(bytes.length);
    made.set(bytes);
    return made;
  }

  static concat(parts) {
    return Bytes.from(parts.flatMap((part) => [...part]));
  }

  toString(encoding) {
    if (encoding !== "hex") throw new Error(`Bytes.toString(${encoding})`);
    return Array.from(this, (byte) => byte.toString(16).padStart(2, "0")).join("");
  }
}
globalThis.Buffer = Bytes;
globalThis.process = { env: { LIGHTWELL_MODULE: "/dist/lightwell.js", LIGHTWELL_ANSWERS: "/answers" } };

export const pathToFileURL = (path) => new URL(path, location.origin);

export function readFileSync(path, encoding) {
  const request = new XMLHttpRequest();
  request.open("GET", path, false);
  // Every byte becomes one character.
  request.overrideMimeType("text/plain; charset=x-user-defined");
  request.send();
  if (request.status !== 200) throw new Error(`${path}: ${request.status}`);
  const text = request.responseText;
  const bytes = new Bytes(text.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = text.charCodeAt(i);
  return encoding ? new TextDecoder(encoding).decode(bytes) : bytes;
}

const isObject = (value) => typeof value === "object" && value !== null;

function same(a, b) {
  if (!isObject(a) || !isObject(b)) return Object.is(a, b);
  if (a instanceof Set || a instanceof Map || b instanceof Set || b instanceof Map)
    return a.constructor === b.constructor && same([...a], [...b]);
  const isList = (value) => Array.isArray(value) || ArrayBuffer.isView(value);
  if (isList(a) !== isList(b)) return false;
  if (isList(a)) return a.length === b.length && a.every((value, k) => same(value, b[k]));
  const [ofA, ofB] = [Object.keys(a), Object.keys(b)];
  return ofA.length === ofB.length && ofA.every((key) => key in b && same(a[key], b[key]));
}

/** what: a function, because values may be long. */
function check(holds, what, message) {
  if (!holds) throw new Error(message ? `${message}: ${what()}` : what());
}

const assert = {
  ok: (value, message) => check(value, () => `${value} is not true`, message),
  equal: (a, b, message) => check(Object.is(a, b), () => `${a} is not ${b}`, message),
  deepEqual: (a, b, message) => check(same(a, b), () => `${a} is not ${b}`, message),
  match: (text, pattern, message) => check(pattern.test(text), () => `${text} does not match ${pattern}`, message),
  fail: (message) => check(false, () => message),
  throws(call, expected) {
    let thrown = null;
    try {
      call();
    } catch (error) {
      thrown = error;
    }
    check(thrown !== null, () => "nothing was thrown");
    if (expected instanceof RegExp)
      check(expected.test(String(thrown)), () => `${thrown} does not match ${expected}`);
    else if (typeof expected === "function")
      // A class, or a function that judges the error.
      check(expected.prototype ? thrown instanceof expected : expected(thrown), () => `${thrown}: ${expected}`);
    else if (isObject(expected))
      for (const [key, value] of Object.entries(expected))
        assert[value instanceof RegExp ? "match" : "equal"](thrown[key], value, key);
  },
};
export default assert;

const tests = [];
export const test = (name, run) => tests.push({ name, run });

/** Runs the tests of a module: [{ name, error }], error "" where it passed. */
export async function resultsOf(module) {
  await import(module);
  const results = [];
  for (const { name, run } of tests) {
    let error = "";
    try {
      await run();
    } catch (thrown) {
      error = thrown.stack ?? String(thrown);
    }
    results.push({ name, error });
  }
  return results;
}
