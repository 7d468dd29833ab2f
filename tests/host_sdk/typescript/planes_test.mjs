// Captured planes of the TypeScript module against the results of C++. Format of the files: answers/plane_answers.hpp.
// usage: node --test planes_test.mjs, with LIGHTWELL_MODULE (lightwell.js) and LIGHTWELL_ANSWERS (the folder)
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

const {
  DecodeError, HemisphereGrid, PlaneAppearance, PlaneReader, decodeDescriptor, decodePlaneUpdate, guidanceDiscRadius,
  planeFlags, probeDirection, readRecording, stereographic,
} = await import(pathToFileURL(process.env.LIGHTWELL_MODULE).href);
const folder = process.env.LIGHTWELL_ANSWERS;

const lines = (name) => readFileSync(`${folder}/${name}`, "utf8").trimEnd().split("\n").map((line) => line.split(" "));
const bytesOf = (hex) => Uint8Array.from(hex?.match(/../g) ?? [], (pair) => parseInt(pair, 16));
const validities = ["valid", "stale", "none", "before_history", "invalid_query"];
const layers = ["all", "diffuse", "specular"];
const bitsOf = (flags) => [...flags].reduce((sum, flag) => sum + (1 << planeFlags.indexOf(flag)), 0);

/** Sines and cosines differ by a rounding error between languages, sums in float by a few: 1e-6 of the brightest. */
const brightest = 30;
let compared = 0;
function near(got, expected, what, size = 1) {
  assert.equal(got.length, expected.length, what);
  [...got].forEach((v, k) =>
    assert.ok(Math.abs(v - expected[k]) <= 1e-6 * size, `${what}: ${[...got]} is not ${expected}`));
  ++compared;
}

const codeOf = (call) => {
  try {
    call();
  } catch (error) {
    assert.ok(error instanceof DecodeError, error.stack);
    assert.match(error.message, /^plane update: /);
    return error.code;
  }
  return "ok";
};

function answerIs(answer, [validity, flags, ...rgb], what) {
  assert.equal(answer.validity, validities[validity], what);
  assert.equal(bitsOf(answer.flags), flags, what);
  near(answer.value, rgb, what, brightest);
}

function infoIs(plane, [validity, revision, missing, capture, edge, size, x, y, rotation, scale, alpha, f0, units]) {
  assert.equal(plane.validity, validities[validity]);
  assert.deepEqual([plane.revision, plane.missingTiles, plane.textureEdge], [BigInt(revision), missing, edge]);
  if (revision === 0) {
    assert.equal(plane.info, null);
    return;
  }
  const { info } = plane;
  assert.deepEqual([info.capture, info.size, info.units], [capture, size, units === 1 ? "relative" : "absolute"]);
  assert.deepEqual(info.textureToPlane, { x, y, rotation, scale });
  near([info.glossAlpha ?? -1, info.f0 ?? -1], [alpha, f0], "gloss");
}

/** Checks one line about a snapshot; a rendering is kept for the lines of its pixels. */
function lineIs(plane, word, v, rendering) {
  switch (word) {
    case "info":
      infoIs(plane, v);
      break;
    case "pose":
      near([...plane.info.pose.translation, ...plane.info.pose.rotation], v, word);
      break;
    case "radiance":
      answerIs(plane.radiance(v.slice(1, 3), v.slice(3, 6), layers[v[0]]), v.slice(6), `${word} ${v}`);
      break;
    case "specular":
      answerIs(plane.specular(v.slice(0, 3)), v.slice(3), `${word} ${v}`);
      break;
    case "texel": {
      const { radiance, state } = plane.texture;
      assert.equal(state[v[0]] === 0 ? 4 : state[v[0]] === 2 ? 8 : 0, v[1], word);
      if (state[v[0]] !== 0) near(radiance.subarray(3 * v[0], 3 * v[0] + 3), v.slice(2), word, brightest);
      break;
    }
    case "guidance": {
      const guidance = plane.guidance();
      assert.equal(guidance.progress, v[0] === 1 ? "enough" : "keep_moving");
      near([guidance.seen, guidance.gap, ...(guidance.next ?? [0, 0, 0])], v.slice(1, 6), word);
      near([guidanceDiscRadius()], v.slice(6), word);
      break;
    }
    case "probe":
      near(probeDirection(plane.info) ?? [0, 0, 0], v, word);
      break;
    case "coverage":
      near(stereographic(plane.coverage.grid.direction(v[0])), v.slice(1, 3), word);
      assert.equal(plane.coverage.seen[v[0]], v[3]);
      break;
    case "camera": {
      const [width, height, fx, fy, cx, cy] = v;
      const pose = { translation: v.slice(6, 9), rotation: v.slice(9, 13) };
      const drawn = plane.render({ width, height, fx, fy, cx, cy, pose }, layers[v[13]]);
      const count = (bytes) => bytes.reduce((sum, b) => sum + (b !== 0 ? 1 : 0), 0);
      assert.equal(drawn.validity, validities[v[14]]);
      assert.deepEqual([drawn.flags.reduce((a, b) => a | b, 0), count(drawn.drawn), count(drawn.flags)], v.slice(15));
      return drawn;
    }
    case "pixel":
      assert.deepEqual([rendering.drawn[v[0]], rendering.flags[v[0]]], [1, v[1]]);
      near(rendering.rgb.subarray(3 * v[0], 3 * v[0] + 3), v.slice(2), word, brightest);
      break;
    default:
      assert.fail(`a line of a known kind: ${word}`);
  }
  return rendering;
}

test("reader and queries give the results of C++", () => {
  const reader = new PlaneReader();
  let plane = null;
  let rendering = null;
  const met = new Set();
  for (const [word, ...rest] of lines("planes.txt")) {
    if (word === "take") assert.equal(codeOf(() => reader.take(bytesOf(rest[2]), Number(rest[1]))), rest[0]);
    else if (word === "snapshot") plane = reader.snapshot(Number(rest[0]));
    else rendering = lineIs(plane, word, rest.map(Number), rendering);
    if (word === "take") met.add(rest[0]);
  }
  assert.deepEqual([reader.messages > 3, reader.refused > 2, [...met].sort()],
                   [true, true, ["data_loss", "invalid_argument", "ok"]]);
  assert.ok(compared > 2000, `${compared} compared`);
});

test("a snapshot does not change", () => {
  const messages = lines("planes.txt").filter(([word, status]) => word === "take" && status === "ok");
  const reader = new PlaneReader();
  reader.take(bytesOf(messages[0][3]), 0);
  const before = reader.snapshot(0);
  const missing = before.missingTiles;
  assert.ok(missing > 0);
  for (const [, , , hex] of messages.slice(1, 3)) reader.take(bytesOf(hex), 1);
  assert.equal(before.missingTiles, missing);
  assert.equal(reader.snapshot(1).missingTiles, 0);
  assert.ok(reader.complete);
});

test("damaged messages are accepted and refused as in C++", () => {
  const count = { ok: 0, data_loss: 0, invalid_argument: 0 };
  let update = null;
  for (const [word, ...rest] of lines("plane_mutants.txt")) {
    if (word === "update") {
      const [revision, edge, tiles, ...rgb] = rest;
      assert.deepEqual([update.revision, update.layout.textureEdge, update.tiles.length],
                       [BigInt(revision), Number(edge), Number(tiles)]);
      const last = update.tiles.filter((tile) => tile.radiance.length > 0).at(-1)?.radiance.slice(-3) ?? [0, 0, 0];
      assert.deepEqual([...last].map(Math.fround), rgb.map(Number).map(Math.fround));
      continue;
    }
    const found = codeOf(() => (update = decodePlaneUpdate(bytesOf(rest[1]))));
    assert.equal(found, rest[0], rest[1]);
    ++count[found];
  }
  console.log(`${count.ok} taken, ${count.data_loss} torn, ${count.invalid_argument} invalid`);
  for (const n of Object.values(count)) assert.ok(n > 300, "each kind was met often");
});

test("a recording with planes gives both kinds of messages", () => {
  const file = readFileSync(`${folder}/planes.lwrec`);
  const { messages, tornBytes } = readRecording(file);
  assert.equal(tornBytes, 0);
  assert.deepEqual(messages.map(({ kind }) => kind).slice(0, 2), ["descriptor", "plane"]);
  assert.equal(decodeDescriptor(messages[0].bytes).sequence, 1n);
  const reader = new PlaneReader();
  const planes = messages.filter(({ kind }) => kind === "plane");
  const taken = lines("planes.txt").filter(([word, status]) => word === "take" && status === "ok");
  assert.deepEqual(planes.map(({ bytes }) => Buffer.from(bytes).toString("hex")), taken.map((line) => line[3]));
  for (const { bytes, timeNs } of planes) reader.take(bytes, Number(timeNs) / 1e6);
  assert.equal(reader.snapshot(3000).info.capture, 8);
  const damaged = Uint8Array.from(file);
  damaged[file.length - 3] ^= 1;
  assert.equal(readRecording(damaged).messages.length, messages.length - 1);
  const later = Uint8Array.from(file);
  later[5] = 3;
  assert.throws(() => readRecording(later), /container version 3 is not known/);
});

test("hostile sizes are refused quickly", () => {
  assert.equal(codeOf(() => decodePlaneUpdate(new Uint8Array(65537))), "data_loss");
  assert.equal(codeOf(() => decodePlaneUpdate(new Uint8Array(0))), "invalid_argument");
  const tiles = Uint8Array.from({ length: 65535 }, (_, i) => [0x82, 0x01, 0][i % 3]);
  assert.equal(codeOf(() => decodePlaneUpdate(tiles)), "invalid_argument");
  const none = new PlaneAppearance(null, 0);
  assert.deepEqual([none.validity, none.radiance([0, 0], [0, 0, 1]).validity, none.guidance()], ["none", "none", null]);
  assert.equal(none.radiance([NaN, 0], [0, 0, 1]).validity, "invalid_query");
  assert.equal(new HemisphereGrid(60).size, 7321);
});
