// PlaneCoverageReader of the TypeScript module. usage: as connection_test.mjs
import assert from "node:assert/strict";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

import { decode, encode, vector } from "./fake_probe.mjs";

const { DecodeError, PlaneCoverageReader, hemisphereNodes } =
  await import(pathToFileURL(process.env.LIGHTWELL_MODULE).href);

/** A plane with a texture of two by two tiles, a lumisphere of one tile and a coverage of two. */
const levels = 70;
const nodes = hemisphereNodes(levels);
const tile = (index, count, byte) =>
  `tiles { index: ${index} states: "${`\\${byte.toString(8).padStart(3, "0")}`.repeat(Math.ceil(count / 8))}" }`;
const text = ({ capture = 7, revision = 3, tiles = "", revisions = [1, 1, 1, 1, 1, 2, 3], more = "" } = {}) =>
  `wire_version: 1 capture: ${capture} revision: ${revision} mid_exposure_ns: 5 units: UNITS_ABSOLUTE size_m: 0.2 ` +
  `texture_edge: 40 lumisphere_levels: 4 coverage_levels: ${levels} key_interval_ms: 10000 gloss_alpha: 0.05 ` +
  `T_probe_plane { qx: 0 qy: 0 qz: 0 qw: 2 tz: -1 } ${revisions.map((v) => `tile_revision: ${v}`).join(" ")} ` +
  `${tiles} ${more}`;
const message = (options) => encode("PlaneUpdate", text(options));
const count = (coverage) => coverage.seen.reduce((sum, v) => sum + v, 0);

test("the coverage is that of the tiles, and stays until a new capture", () => {
  assert.equal(nodes, 9941);
  const reader = new PlaneCoverageReader();
  const first = reader.take(message({ tiles: tile(5, 8192, 0xff) }));
  assert.deepEqual([first.sizeM, first.textureEdge, first.levels, first.revision], [0.2, 40, levels, 3n]);
  assert.deepEqual(first.pose, { rotation: [0, 0, 0, 1], translation: [0, 0, -1] });
  assert.equal(count(first), 8192);
  const second = reader.take(message({
    revision: 4, revisions: [1, 1, 1, 1, 1, 2, 4], tiles: tile(6, nodes - 8192, 0x01),
  }));
  assert.equal(count(second), 8192 + Math.ceil((nodes - 8192) / 8));
  assert.equal(second.seen[8192], 1);
  assert.equal(second.seen[8193], 0);
  // Overtaken: the tile was newer already.
  const late = reader.take(message({ revisions: [1, 1, 1, 1, 1, 1, 3], tiles: tile(5, 8192, 0) }));
  assert.equal(count(late), count(second));
  assert.equal(count(reader.take(message({ capture: 8 }))), 0);
});

test("the texture and the lumisphere are skipped", () => {
  const reader = new PlaneCoverageReader();
  const coverage = reader.take(message({ tiles: tile(0, 1024, 0xff) + tile(4, 41, 0xff) }));
  assert.equal(count(coverage), 0);
});

test("the golden message is accepted", () => {
  const bytes = vector("captured_plane/v1_small");
  const { levels: found } = new PlaneCoverageReader().take(bytes);
  assert.match(decode("PlaneUpdate", bytes), new RegExp(`coverage_levels: ${found} `));
});

test("updates that violate the specification are refused, and what was known stays", () => {
  const reader = new PlaneCoverageReader();
  reader.take(message({ tiles: tile(5, 8192, 0xff) }));
  const edited = (from, to) => encode("PlaneUpdate", text().replace(from, to));
  const wrong = [
    edited("wire_version: 1", "wire_version: 2"), edited("capture: 7", "capture: 0"),
    edited("revision: 3", "revision: 0"), edited("size_m: 0.2", "size_m: nan"),
    edited("UNITS_ABSOLUTE", "UNITS_UNSPECIFIED"), edited("qw: 2", "qw: 0"),
    edited("coverage_levels: 70", "coverage_levels: 129"), edited("coverage_levels: 70", "coverage_levels: 0"),
    edited("lumisphere_levels: 4", "lumisphere_levels: 0"), edited("texture_edge: 40", "texture_edge: 257"),
    message({ revisions: [1] }), message({ tiles: tile(7, 8192, 0) }), message({ tiles: tile(5, 8193, 0) }),
  ];
  for (const bytes of wrong)
    assert.throws(() => reader.take(bytes), (e) => e instanceof DecodeError && e.code === "invalid_argument");
  for (const bytes of [new Uint8Array(65537), message().subarray(0, -1)])
    assert.throws(() => reader.take(bytes), (e) => e instanceof DecodeError && e.code === "data_loss");
  assert.equal(count(reader.take(message())), 8192);
});
