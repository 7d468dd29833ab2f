// cubeMap() of the TypeScript module against the results of C++. Format of the file: answers/cube_answers.hpp.
// usage: node --test cube_map_test.mjs; environment: that of typescript_test.mjs
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

const { Lighting, cubeDirection, cubeMap } = await import(pathToFileURL(process.env.LIGHTWELL_MODULE).href);
const lines = readFileSync(`${process.env.LIGHTWELL_ANSWERS}/cube_maps.txt`, "utf8").trimEnd().split("\n");
const bytesOf = (hex) => Uint8Array.from(hex.match(/../g), (pair) => parseInt(pair, 16));
const lightOf = (line) => Lighting.decode(bytesOf(line.split(" ")[1]));

/** Relative to the brightest texel: C++ sums floats, up to 26² for a texel. */
const tolerance = 3e-6;

test("texels are those of C++", () => {
  let light;
  let maps = 0;
  let worst = 0;
  for (const line of lines) {
    if (line.startsWith("message ")) {
      light = lightOf(line);
      continue;
    }
    const [edge, lights, scale, clamped, ...expected] = line.split(" ").slice(1).map(Number);
    const map = cubeMap(light, { edge, scale, format: "rgba32f", lights: lights === 1 ? "included" : "excluded" });
    assert.equal(map.clamped, clamped);
    assert.equal(map.texels.length, expected.length / 3 * 4);
    const most = expected.reduce((a, b) => Math.max(a, b), 1e-30);
    map.texels.forEach((v, i) => {
      if (i % 4 === 3) return assert.equal(v, 1);
      const error = Math.abs(v - expected[Math.floor(i / 4) * 3 + i % 4]) / most;
      worst = Math.max(worst, error);
      assert.ok(error <= tolerance, `texel ${i} of ${line.slice(0, 20)}: ${v}, error ${error}`);
    });
    ++maps;
  }
  console.log(`# ${maps} maps, largest error ${worst.toExponential(1)} of the brightest texel`);
  assert.ok(maps > 20);
});

/** The value of a half float. */
function half(code) {
  const exponent = code >> 10;
  const mantissa = code & 1023;
  return exponent === 0 ? mantissa * 2 ** -24 : (1024 + mantissa) * 2 ** (exponent - 25);
}

test("the other formats hold the same values, rounded", () => {
  for (const line of lines.filter((text) => text.startsWith("message "))) {
    const light = lightOf(line);
    const exact = cubeMap(light, { edge: 3, format: "rgba32f" }).texels;
    const halves = cubeMap(light, { edge: 3 });
    const packed = cubeMap(light, { edge: 3, format: "rgb9e5" });
    assert.ok(halves.texels instanceof Uint16Array && packed.texels instanceof Uint32Array);
    for (let i = 0; i < exact.length; ++i) {
      const expected = Math.min(exact[i], 65504);
      assert.ok(Math.abs(half(halves.texels[i]) - expected) <= Math.max(expected * 2 ** -11, 2 ** -25), `half ${i}`);
      if (i % 4 === 3) continue;
      const code = packed.texels[Math.floor(i / 4)];
      const unit = 2 ** ((code >>> 27) - 24);
      const value = ((code >>> (9 * (i % 4))) & 511) * unit;
      assert.ok(Math.abs(value - Math.min(exact[i], 65408)) <= unit * 0.5001, `RGB9E5 ${i}: ${value}, ${exact[i]}`);
    }
    const bright = exact.reduce((count, v, i) => count + (i % 4 === 0 &&
      Math.max(v, exact[i + 1], exact[i + 2]) > 65504 ? 1 : 0), 0);
    assert.equal(halves.clamped, bright);
  }
});

test("a texel of a face looks along its direction", () => {
  assert.deepEqual(cubeDirection(0, 0.5, 0.5), [1, 0, 0]);
  // OpenGL 4.6, table 8.19: on +Y, s runs with +X and t with +Z.
  const d = cubeDirection(2, 0.75, 0.25);
  assert.ok(d[0] > 0 && d[1] > 0.8 && d[2] < 0);
});

test("without light it is black, and options are checked", () => {
  const empty = cubeMap(new Lighting(null), { edge: 2 });
  assert.equal(empty.about.validity, "none");
  assert.ok(empty.texels.every((v, i) => v === (i % 4 === 3 ? 0x3c00 : 0)));
  assert.equal(cubeMap(new Lighting(null)).texels.length, 6 * 64 * 64 * 4);
  for (const [name, value] of [["edge", 0], ["edge", 65], ["edge", 2.5], ["format", "rgba8"], ["lights", true],
                               ["scale", 0], ["scale", NaN], ["scale", Infinity]])
    assert.throws(() => cubeMap(new Lighting(null), { [name]: value }), (error) =>
      error instanceof RangeError && error.message.startsWith(name), `${name} ${value}`);
});
