// The TypeScript module against the results of C++: golden messages, a recording, and damaged messages.
// usage: node --test typescript_test.mjs, with LIGHTWELL_MODULE (lightwell.js) and LIGHTWELL_ANSWERS (the folder)
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

const lightwell = await import(pathToFileURL(process.env.LIGHTWELL_MODULE).href);
const part = (name) => import(new URL(name, pathToFileURL(process.env.LIGHTWELL_MODULE)).href);
const { toWebXr } = await part("webxr/webxr.js");
const { rotatedLighting } = await part("webxr/rotation.js");
const { DecodeError, EnvironmentKeeper, Lighting, decodeDescriptor, levelRadiance, readRecording, toThree } = lightwell;
const folder = process.env.LIGHTWELL_ANSWERS;

/** Tolerance, relative to the largest value that all light together can give. */
const tolerance = 1e-6;

const lines = (name) => readFileSync(`${folder}/${name}`, "utf8").trimEnd().split("\n").map((line) => line.split(" "));
const bytesOf = (hex) => Uint8Array.from(hex.match(/../g) ?? [], (pair) => parseInt(pair, 16));
const number = (text) => (text === "inf" ? Infinity : Number(text));

function messages() {
  const out = [];
  for (const [word, ...rest] of lines("answers.txt")) {
    if (word === "message" || word === "final")
      out.push({ bytes: word === "final" ? null : bytesOf(rest[0]), rows: [] });
    else if (word === "engine") out.at(-1).rows.push([word, [rest[0], ...rest.slice(1).map(number)]]);
    else out.at(-1).rows.push([word, word === "info" ? [rest[0], ...rest.slice(1).map(number)] : rest.map(number)]);
  }
  return out;
}

/** What all coefficients and lights could add up to at most: errors are measured against that. */
function scale(descriptor) {
  const of = (values) => values.reduce((sum, v) => sum + Math.max(...v.map(Math.abs)), 0);
  return of(descriptor.radiance) + of(descriptor.lights.map((light) => light.irradiance));
}

let worst = 0;
function near(got, expected, size, what) {
  got.forEach((value, k) => {
    const error = Math.abs(value - expected[k]) / (size || 1);
    if (error > worst) worst = error;
    assert.ok(error <= tolerance, `${what}: ${got} is not ${expected}: ${error}`);
  });
}

/** Bit for bit: nine digits are a float. */
function same(got, expected, what) {
  assert.deepEqual(Array.from(got, Math.fround), expected.map(Math.fround), what);
}

function threeAgrees(light, [lights, mainLight, validity, residual, ...numbers], size) {
  const converted = toThree(light, {
    lights: lights === 0 ? "physical" : "legacy",
    mainLight: mainLight === 0 ? "apart" : "in_harmonics",
  });
  assert.equal(converted.validity, ["valid", "stale", "none"][validity]);
  near([converted.residual], [residual], 1, "residual for three.js");
  const { sh, lightProbeIntensity, position, color, intensity } = converted.value;
  near(sh, numbers.slice(0, 27), size, "harmonics for three.js");
  near([lightProbeIntensity, ...position, ...color], numbers.slice(27, 34), 1, "direction and colour for three.js");
  near([intensity], numbers.slice(34), size, "intensity for three.js");
  assert.equal(numbers.length, 35);
  ++threeCompared;
}
let threeCompared = 0;

function webXrAgrees(light, [signs, , validity, , ...numbers], size) {
  const converted = toWebXr(light, { signs: signs === 0 ? "condon_shortley" : "positive" });
  assert.equal(converted.validity, ["valid", "stale", "none"][validity]);
  near([...converted.sphericalHarmonicsCoefficients], numbers.slice(0, 27), size, "harmonics for WebXR");
  near([...converted.primaryLightDirection, 0], numbers.slice(27, 31), 1, "direction for WebXR");
  near([...converted.primaryLightIntensity], numbers.slice(31, 34), size, "intensity for WebXR");
  assert.equal(numbers.length, 35);
  ++webXrCompared;
}
let webXrCompared = 0;

const flagBit = {
  unseen: 2, clipped: 4, cleaned: 8, dark: 16, moved: 32, filled: 64, recovered: 128, unsure: 256, newer: 2 ** 31,
};
const bitsOf = (flags) => [...flags].reduce((sum, flag) => sum + flagBit[flag], 0);

function agrees(light, rows) {
  const d = light.descriptor;
  const size = scale(d);
  let lightNumber = 0;
  let levelNumber = 0;
  for (const [word, v] of rows) {
    switch (word) {
      case "info": {
        const [sequence, units, flags, bound, band, count, coverage] = v;
        assert.equal(d.sequence, BigInt(sequence));
        assert.equal(d.units, units === 1 ? "relative" : "absolute");
        assert.equal(bitsOf(d.flags), flags);
        assert.equal(d.band, band);
        assert.equal(light.lights.length, count);
        same([d.bound.total, d.coverage], [bound, coverage], word);
        break;
      }
      case "irradiance":
        near(light.irradiance(v.slice(0, 3)).value, v.slice(3), size, word);
        break;
      case "radiance": {
        // The scale is that of the map's texels, plus the peak of a light's lobe.
        const answer = light.radiance(v.slice(0, 3), v[3]);
        near(answer.value, v.slice(4), Math.max(size, ...v.slice(4).map(Math.abs)), `${word} at roughness ${v[3]}`);
        assert.equal(answer.lightsIncluded, v[3] > 0);
        break;
      }
      case "coefficient":
        if (v[0] === 0) same(d.radiance[v[1]], v.slice(2), word);
        else near(light.irradianceCoefficients()[v[1]], v.slice(2), size, word);
        break;
      case "light": {
        const l = light.lights[lightNumber++];
        same(l.direction, v.slice(0, 3), "direction");
        same(l.irradiance, v.slice(3, 6), "irradiance of a light");
        same([l.angularRadius, ...l.directionCovariance, l.track], v.slice(6, 11), "radius, covariance, track");
        same([l.distance, l.distanceSigma], v.slice(11, 13), "distance");
        assert.equal(l.position !== null, v[11] > 0);
        near(l.position ?? [0, 0, 0], v.slice(13), 1, "position");
        break;
      }
      case "origin":
        // Nine digits.
        near([...d.origin.translation, ...d.origin.rotation], v, 1, word);
        break;
      case "map":
        assert.equal(light.environment?.levels.length ?? 0, v[0]);
        assert.equal(light.environment?.exponent ?? 0, v[1]);
        break;
      case "level":
        same([light.environment.levels[levelNumber].edge, light.environment.levels[levelNumber++].roughness], v, word);
        break;
      case "texel": {
        const rgb = levelRadiance(light.environment, v[0]);
        same(rgb.subarray(3 * v[1], 3 * v[1] + 3), v.slice(2), word);
        break;
      }
      case "engine":
        if (v[0] === "three") threeAgrees(light, v.slice(1), size);
        if (v[0] === "webxr") webXrAgrees(light, v.slice(1), size);
        break; // Other conversions exist only in the C ABI.
      case "rotated": {
        const rotated = rotatedLighting(light, v.slice(0, 4));
        near(rotated.irradiance(v.slice(4, 7)).value, v.slice(7), size, "rotated");
        break;
      }
      default:
        assert.fail(`a line of a known kind: ${word}`);
    }
  }
}

test("decoding and queries give the results of C++", () => {
  const all = messages().filter((message) => message.bytes !== null);
  assert.ok(all.length > 15);
  for (const { bytes, rows } of all) agrees(Lighting.decode(bytes), rows);
  assert.ok(worst > 0, "something was compared");
  assert.equal(threeCompared, 4 * all.length);
  assert.equal(webXrCompared, 2 * all.length);
  console.log(`largest difference: ${worst.toExponential(1)} of all light`);
});

test("a recording with map changes gives the last lighting of C++", () => {
  const file = readFileSync(`${folder}/answers.lwrec`);
  const recording = readRecording(file);
  assert.equal(recording.messages.length, 14);
  assert.equal(recording.tornBytes, 0);
  const keeper = new EnvironmentKeeper();
  let light = null;
  for (const message of recording.messages) {
    assert.equal(message.kind, "descriptor");
    const descriptor = decodeDescriptor(message.bytes);
    assert.ok(keeper.take(descriptor));
    light = new Lighting(descriptor, { environment: keeper.mapFor(descriptor) });
  }
  assert.ok(light.environment !== null);
  agrees(light, messages().at(-1).rows);

  // Changes without their whole map are rejected.
  const late = new EnvironmentKeeper();
  const changes = decodeDescriptor(recording.messages[9].bytes);
  assert.equal(late.take(changes), false);
  assert.equal(late.mapFor(changes), null);

  // A map whose texels do not match its key.
  const { bytes } = recording.messages[3];
  for (let at = bytes.length / 2 - 100; at < bytes.length / 2 + 100; at += 20) {
    const changed = Uint8Array.from(bytes);
    changed[Math.round(at)] ^= 16;
    assert.throws(() => decodeDescriptor(changed), /environment\.key does not match the content of the map/);
  }

  const torn = readRecording(file.subarray(0, file.length - 5));
  assert.equal(torn.messages.length, 13);
  assert.ok(torn.tornBytes > 0);
  const damaged = Uint8Array.from(file);
  damaged[file.length - 3] ^= 1;
  assert.equal(readRecording(damaged).messages.length, 13);
  assert.throws(() => readRecording(new Uint8Array([1, 2, 3])), DecodeError);
  assert.throws(() => readRecording(file.subarray(0, 12)), DecodeError);
});

test("damaged messages are accepted and rejected as in C++", () => {
  const count = { ok: 0, data_loss: 0, invalid_argument: 0 };
  let descriptor = null;
  let newer = 0;
  let placed = 0;
  for (const [word, ...rest] of lines("mutants.txt")) {
    if (word === "irradiance") {
      const v = rest.map(number);
      near(new Lighting(descriptor).irradiance(v.slice(0, 3)).value, v.slice(3), scale(descriptor), "of a mutant");
      continue;
    }
    if (word === "origin") {
      const v = rest.map(number);
      near([...descriptor.origin.translation, ...descriptor.origin.rotation], v, Math.max(1, ...v.map(Math.abs)), word);
      if (v[6] !== 1) ++placed;
      continue;
    }
    if (word === "distances") {
      same(descriptor.lights.map((light) => light.distance), rest.map(number), word);
      continue;
    }
    if (word === "flags") {
      assert.equal(bitsOf(descriptor.flags), number(rest[0]));
      if (descriptor.flags.has("newer")) ++newer;
      continue;
    }
    const [status, hex] = rest;
    let found = "ok";
    try {
      descriptor = decodeDescriptor(bytesOf(hex ?? ""));
    } catch (error) {
      assert.ok(error instanceof DecodeError, `${error.stack} of ${hex}`);
      assert.ok(error.name === "DecodeError" && error.message.startsWith("descriptor: "));
      found = error.code;
    }
    assert.equal(found, status, hex);
    ++count[status];
  }
  console.log(`${count.ok} taken, ${count.data_loss} torn, ${count.invalid_argument} invalid`);
  assert.ok(newer > 0, "a reason of the future was met");
  assert.ok(placed > 100, "origins were met");
  for (const n of Object.values(count)) assert.ok(n > 300, "each kind was met often");
});

test("unknown fields of every wire type are ignored", () => {
  const [{ bytes, rows }] = messages();
  const future = [0xc0, 0x3e, 0x05, 0xc9, 0x3e, 1, 2, 3, 4, 5, 6, 7, 8, 0xd2, 0x3e, 2, 9, 9, 0xd3, 0x3e, 0x08, 0x01,
                  0xd4, 0x3e, 0xdd, 0x3e, 1, 2, 3, 4];
  agrees(Lighting.decode(Uint8Array.from([...bytes, ...future])), rows);
  agrees(Lighting.decode(Uint8Array.from([...future, ...bytes])), rows);
});

test("a view into a larger buffer is decoded in place", () => {
  const { bytes, rows } = messages()[3];
  const larger = new Uint8Array(bytes.length + 20);
  larger.set(bytes, 7);
  agrees(Lighting.decode(larger.subarray(7, 7 + bytes.length)), rows);
});

test("hostile sizes are rejected quickly", () => {
  const code = (bytes) => {
    try {
      decodeDescriptor(bytes);
    } catch (error) {
      assert.ok(error instanceof DecodeError);
      return error.code;
    }
    return "ok";
  };
  assert.equal(code(new Uint8Array(65537)), "data_loss");
  assert.equal(code(new Uint8Array(0)), "invalid_argument");
  assert.equal(code(Uint8Array.from([0x2a, 0xff, 0xff, 0xff, 0xff, 0x07])), "data_loss", "a part of 2 GiB");
  assert.equal(code(Uint8Array.from([0x2a, 0xff, 0xff, 0xff, 0xff, 0x0f])), "data_loss", "a part of less than nothing");
  assert.equal(code(Uint8Array.from([0x2a, 0xfa, 0xff, 0xff, 0xff, 0x0f])), "data_loss", "a length that leads back");
  assert.equal(code(Uint8Array.from([0x2a, 0x80, 0x80, 0x80, 0x80, 0x80, 0])), "data_loss", "a length of six bytes");
  assert.equal(code(new Uint8Array(60000).fill(0xa3)), "data_loss", "groups without end");
  const lights = Uint8Array.from({ length: 65536 }, (_, i) => (i % 2 ? 0 : 0x32));
  assert.equal(code(lights), "invalid_argument", "32768 lights");
});

test("a recording that is written here is read again, also when it is cut", () => {
  const { recordingStart, encodeRecord } = lightwell;
  const parts = [recordingStart("attic", "test 1"), ...[5n, -7n].map((timeNs, i) =>
    encodeRecord({ timeNs, bytes: messages()[i].bytes }))];
  const file = Buffer.concat(parts);
  const { messages: read, tornBytes, header } = readRecording(file);
  assert.deepEqual(read.map(({ timeNs }) => timeNs), [5n, -7n]);
  assert.deepEqual(Buffer.from(read[1].bytes), Buffer.from(messages()[1].bytes));
  assert.equal(tornBytes, 0);
  assert.deepEqual([...header], [8, 1, 0x12, 5, ...Buffer.from("attic"), 0x1a, 6, ...Buffer.from("test 1")]);
  assert.equal(readRecording(file.subarray(0, -1)).messages.length, 1);
});

test("three.js conversion with and without an estimate", () => {
  const light = Lighting.decode(messages().at(-2).bytes);
  const half = toThree(light, { color: [0.5, 0, 0, 0, 0.5, 0, 0, 0, 0.5], residual: "left_out" });
  assert.equal(half.residual, null);
  const whole = toThree(light);
  near(half.value.sh, whole.value.sh.map((v) => v / 2), scale(light.descriptor), "half");
  assert.ok(Math.abs(half.value.intensity * 2 - whole.value.intensity) < 1e-6 * whole.value.intensity);
  for (const color of [[1, 2, 3], new Array(9).fill(NaN), new Array(9).fill(1e300)]) {
    const refused = toThree(light, { color });
    assert.equal(refused.validity, "invalid_query");
    assert.deepEqual([refused.value.intensity, refused.value.lightProbeIntensity], [0, 0]);
  }
  assert.equal(toThree(new Lighting(null)).validity, "none");
});

test("an answer has validity, age and error bound", () => {
  const last = messages().at(-2).bytes;
  const valid = Lighting.decode(last, { ageMs: 20 }).irradiance([0, 2, 0]);
  assert.deepEqual([valid.validity, valid.reason, valid.ageMs, valid.units], ["valid", "", 20, "absolute"]);
  assert.ok(valid.errorBound > 0 && valid.lightsIncluded);
  const stale = Lighting.decode(last, { ageMs: 300 }).irradiance([0, 1, 0]);
  assert.equal(stale.validity, "stale");
  assert.match(stale.reason, /300 ms/);
  assert.ok(stale.value[0] > 0);
  assert.equal(Lighting.decode(last, { ageMs: NaN }).validity, "stale");
  const none = new Lighting(null).irradiance([0, 1, 0]);
  assert.deepEqual([none.validity, none.value], ["none", [0, 0, 0]]);
  assert.ok(none.reason.length > 0);
  const light = Lighting.decode(last);
  for (const bad of [[0, 0, 0], [NaN, 0, 1], [0, Infinity, 0]]) {
    for (const answer of [light.irradiance(bad), light.radiance(bad, 0.5)]) {
      assert.deepEqual([answer.validity, answer.value], ["invalid_query", [0, 0, 0]]);
      assert.ok(answer.reason.length > 0);
    }
  }
  assert.equal(light.radiance([0, 1, 0], NaN).validity, "invalid_query");
});
