// Light estimates of the TypeScript module against those of C++. Format of the file: answers/estimate_answers.hpp.
// usage: node --test estimate_test.mjs; environment: that of typescript_test.mjs
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

const { Lighting, colorTemperature, estimateLight, fadeWeight } =
  await import(pathToFileURL(process.env.LIGHTWELL_MODULE).href);
const lines = readFileSync(`${process.env.LIGHTWELL_ANSWERS}/estimates.txt`, "utf8").trimEnd().split("\n");
const bytesOf = (hex) => Uint8Array.from(hex.match(/../g), (pair) => parseInt(pair, 16));
const parts =
  ["ambientIntensity", "ambientColor", "ambientSphericalHarmonics", "mainLightDirection", "mainLightIntensity"];
const validities = ["valid", "stale", "none", "before_history", "invalid_query"];

/** Floats of C++ have seven digits. */
function near(got, expected, size, what) {
  got.forEach((v, i) => {
    const most = 1e-6 * Math.max(size, Math.abs(expected[i]));
    assert.ok(Math.abs(v - expected[i]) <= most, `${what}: ${v}, ${expected[i]}`);
  });
}

function estimateIsThatOfCpp(light, [requested, gain, neutralIlluminance, validity, available, ...v]) {
  const wanted = parts.filter((_, i) => requested & (1 << i));
  const e = estimateLight(light, { requested: wanted, gain, neutralIlluminance });
  assert.equal(e.validity, validities[validity]);
  const all = [e.ambientLumens, e.ambientColor, e.ambientSphericalHarmonics, e.mainLightDirection, e.mainLightLumens];
  assert.equal(all.reduce((bits, value, i) => bits | (value === null ? 0 : 1 << i), 0), available);
  const size = gain * light.descriptor.radiance.reduce((sum, c) => sum + Math.max(...c.map(Math.abs)), 0) +
    gain * light.descriptor.lights.reduce((sum, l) => sum + Math.max(...l.irradiance.map(Math.abs)), 0);
  const lumens = size * 1000 / neutralIlluminance;
  near([e.ambientLumens ?? 0], [v[0]], lumens, "ambient lumens");
  near([e.meanIlluminance ?? 0], [v[1]], size, "illuminance");
  near([e.colorTemperature?.kelvin ?? 0, e.colorTemperature?.duv ?? 0], [v[2], v[3]], 1, "colour temperature");
  near(e.ambientColor ?? [0, 0, 0], v.slice(4, 7), 1, "colour");
  near(e.ambientSphericalHarmonics ?? new Array(27).fill(0), v.slice(7, 34), size, "harmonics");
  near(e.mainLightDirection ?? [0, 0, 0], v.slice(34, 37), 1, "direction");
  near(e.mainLightColor ?? [0, 0, 0], v.slice(37, 40), 1, "colour of the main light");
  near([e.mainLightLumens ?? 0], [v[40]], lumens, "lumens of the main light");
}

test("estimates, colour temperatures and weights are those of C++", () => {
  let light;
  const counts = { estimate: 0, temperature: 0, fade: 0 };
  for (const line of lines) {
    const [word, ...rest] = line.split(" ");
    if (word === "message") {
      light = Lighting.decode(bytesOf(rest[0]));
      continue;
    }
    const v = rest.map(Number);
    ++counts[word];
    if (word === "estimate") {
      estimateIsThatOfCpp(light, v);
    } else if (word === "temperature") {
      const t = colorTemperature(v.slice(0, 3));
      assert.equal(t === null, v[3] === 0, line);
      assert.ok(Math.abs((t?.kelvin ?? 0) - v[3]) <= 1e-9 * v[3] && Math.abs((t?.duv ?? 0) - v[4]) < 1e-12, line);
    } else {
      assert.ok(Math.abs(fadeWeight(v[0] / 1e6, v[1] / 1e6, v[2] / 1e6) - v[3]) < 1e-6, line);
    }
  }
  assert.ok(counts.estimate > 500 && counts.temperature > 300 && counts.fade > 70, JSON.stringify(counts));
});

test("options that are not allowed give no values", () => {
  const light = Lighting.decode(bytesOf(lines[0].split(" ")[1]));
  for (const bad of [0, -1, NaN, Infinity]) {
    for (const options of [{ gain: bad }, { neutralIlluminance: bad }]) {
      const { validity, ambientLumens } = estimateLight(light, options);
      assert.deepEqual([validity, ambientLumens], ["invalid_query", null]);
    }
  }
  assert.equal(estimateLight(light, { requested: ["everything"] }).validity, "invalid_query");
  assert.equal(estimateLight(light, { gain: 1e300 }).validity, "invalid_query");
  assert.equal(estimateLight(new Lighting(null)).validity, "none");
  assert.throws(() => fadeWeight(0, -1), /hold/);
  assert.throws(() => fadeWeight(0, 0, NaN), /fade/);
  assert.equal(fadeWeight(NaN), 0);
  for (const color of [[0, 0, 0], [0, 1, 0], [NaN, 1, 1], [Infinity, 1, 1]])
    assert.equal(colorTemperature(color), null);
});
