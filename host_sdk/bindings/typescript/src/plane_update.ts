// Messages of a captured plane. Wire format: proto/README.md, "Captured planes".
//   decodePlaneUpdate   bytes -> PlaneUpdate, fully validated
//   PlaneTileLayout     which entries a tile has
import { Units } from "./descriptor.js";
import { texelRadiance } from "./environment.js";
import { HemisphereGrid } from "./hemisphere_grid.js";
import { PoseMessage } from "./pose_message.js";
import { Pose } from "./vector.js";
import {
  DecodeError, WireReader, byteString, double, fixed32, fixed64, float, message, repeatedUint64, sint32, uint32, uint64,
} from "./wire.js";

export const maxPlaneMessageBytes = 65536;
const maxTextureEdge = 256;
const maxLevels = 128;

/** p_plane = scale R(rotation) p_texture + (x, y), where R turns +X towards +Y. */
export interface PlaneSimilarity {
  /** m */
  x: number;
  y: number;
  /** rad */
  rotation: number;
  scale: number;
}

/** What holds for the whole plane. Its frame: right-handed, m, origin in the middle of the captured square, +Z the
 *  normal on the viewer's side, +X right, +Y to the top of the texture. */
export interface PlaneInfo {
  /** Another number for each new capture. */
  capture: number;
  /** Of the newest frame that contributed, in the probe's CLOCK_MONOTONIC, ns. */
  midExposureNs: bigint;
  units: Units;
  /** Side of the captured square, m. */
  size: number;
  /** T_probe_plane at midExposureNs; null: not known. */
  pose: Pose | null;
  textureToPlane: PlaneSimilarity;
  /** GGX alpha of the gloss; null: not known. */
  glossAlpha: number | null;
  /** Specular reflectance at normal incidence; null: not known. */
  f0: number | null;
}

/** Of a texel or a direction: 0 unseen, 1 measured, 2 clipped (its radiance is a lower bound). */
export type SampleState = 0 | 1 | 2;

/** The whole content of a tile. */
export interface PlaneTile {
  index: number;
  /** r, g, b of each entry; empty in a tile of the coverage. */
  radiance: Float32Array;
  /** SampleState of each entry; of the coverage: 1 where seen. */
  state: Uint8Array;
}

export interface PlaneUpdate {
  info: PlaneInfo;
  revision: bigint;
  /** Every tile with content is repeated at least so often, ms. */
  keyIntervalMs: number;
  layout: PlaneTileLayout;
  /** By tile: the revision in which its content last changed; 0: it never had content. */
  tileRevision: bigint[];
  tiles: PlaneTile[];
}

const textureTileEdge = 32;
const lumisphereTileNodes = 1024;
const coverageTileNodes = 8192;

/** How the entries of a plane are divided into tiles: those of the texture, row by row from the top, of the lumisphere,
 *  of the coverage. */
export class PlaneTileLayout {
  private readonly across: number;
  private readonly textureTiles: number;
  private readonly lumisphereTiles: number;
  /** Number of tiles. */
  readonly size: number;

  constructor(readonly textureEdge: number, readonly lumisphereLevels: number, readonly coverageLevels: number) {
    const tiles = (levels: number, nodes: number) => Math.ceil(new HemisphereGrid(levels).size / nodes);
    this.across = Math.ceil(textureEdge / textureTileEdge);
    this.textureTiles = this.across ** 2;
    this.lumisphereTiles = tiles(lumisphereLevels, lumisphereTileNodes);
    this.size = this.textureTiles + this.lumisphereTiles + tiles(coverageLevels, coverageTileNodes);
  }

  equals(o: PlaneTileLayout): boolean {
    return this.textureEdge === o.textureEdge && this.lumisphereLevels === o.lumisphereLevels &&
      this.coverageLevels === o.coverageLevels;
  }

  part(tile: number): "texture" | "lumisphere" | "coverage" {
    if (tile < this.textureTiles) return "texture";
    return tile < this.textureTiles + this.lumisphereTiles ? "lumisphere" : "coverage";
  }

  /** Number of entries of a tile. */
  entries(tile: number): number {
    const part = this.part(tile);
    if (part === "texture") return this.span(tile % this.across) * this.span(Math.floor(tile / this.across));
    const levels = part === "lumisphere" ? this.lumisphereLevels : this.coverageLevels;
    const most = part === "lumisphere" ? lumisphereTileNodes : coverageTileNodes;
    return Math.min(most, new HemisphereGrid(levels).size - this.entry(tile, 0));
  }

  /** Index of entry k of a tile in the arrays of its part. */
  entry(tile: number, k: number): number {
    const part = this.part(tile);
    if (part === "texture") {
      const left = tile % this.across;
      const columns = this.span(left);
      const row = Math.floor(tile / this.across) * textureTileEdge + Math.floor(k / columns);
      return row * this.textureEdge + left * textureTileEdge + (k % columns);
    }
    if (part === "lumisphere") return (tile - this.textureTiles) * lumisphereTileNodes + k;
    return (tile - this.textureTiles - this.lumisphereTiles) * coverageTileNodes + k;
  }

  /** The tile that holds an entry of the texture or of the lumisphere. */
  tileOf(part: "texture" | "lumisphere", entry: number): number {
    if (part === "lumisphere") return this.textureTiles + Math.floor(entry / lumisphereTileNodes);
    const row = Math.floor(entry / this.textureEdge);
    return Math.floor(row / textureTileEdge) * this.across +
      Math.floor((entry % this.textureEdge) / textureTileEdge);
  }

  /** Columns or rows of the tiles in column or row k of tiles. */
  private span(k: number): number {
    return Math.min(textureTileEdge, this.textureEdge - k * textureTileEdge);
  }
}

/** Error for a message that violates the specification. */
export function invalidPlane(what: string): DecodeError {
  return new DecodeError("invalid_argument", `plane update: ${what}`);
}

class TileMessage {
  private index = 0;
  private exponent = 0;
  private values = new Uint8Array();
  private states = new Uint8Array();

  read(wire: WireReader): this {
    wire.fields({
      1: uint32((v) => (this.index = v)),
      2: sint32((v) => (this.exponent = v)),
      3: byteString((v) => (this.values = v)),
      4: byteString((v) => (this.states = v)),
    });
    return this;
  }

  get(layout: PlaneTileLayout, revisions: readonly bigint[]): PlaneTile {
    const { index, exponent, values, states } = this;
    if (index >= layout.size) throw invalidPlane("tiles: an index is above that of the last tile");
    if (revisions[index] === 0n) throw invalidPlane("tiles: a tile whose revision is 0");
    const entries = layout.entries(index);
    const coverage = layout.part(index) === "coverage";
    const bits = coverage ? 1 : 2;
    if (exponent < -150 || exponent > 100 || (coverage && exponent !== 0))
      throw invalidPlane("tiles: exponent is out of range");
    if (values.length !== (coverage ? 0 : 4 * entries))
      throw invalidPlane("tiles: the length of values does not match the tile");
    if (states.length !== Math.ceil((entries * bits) / 8))
      throw invalidPlane("tiles: the length of states does not match the tile");
    const stateAt = (k: number) => (states[(k * bits) >> 3] >> ((k * bits) & 7)) & ((1 << bits) - 1);
    for (let k = entries; k < (states.length * 8) / bits; ++k)
      if (stateAt(k) !== 0) throw invalidPlane("tiles: unused bits of states are not 0");
    const state = Uint8Array.from({ length: entries }, (_, k) => stateAt(k));
    if (state.some((s) => s > 2)) throw invalidPlane("tiles: a state is not known");
    const view = new DataView(values.buffer, values.byteOffset, values.byteLength);
    const radiance = new Float32Array((3 * values.length) / 4);
    for (let k = 0; 4 * k < values.length; ++k)
      radiance.set(texelRadiance(view.getUint32(4 * k, true), exponent), 3 * k);
    return { index, radiance, state };
  }
}

function infoChecked(info: PlaneInfo): PlaneInfo {
  const share = (v: number | null) => v === null || (v >= 0 && v <= 1);
  const within = (v: number) => Math.abs(v) <= 1000;
  const { x, y, rotation, scale } = info.textureToPlane;
  if (info.capture === 0) throw invalidPlane("capture is 0");
  if (!(info.size >= 1e-6 && info.size <= 1000)) throw invalidPlane("size_m must be within 1e-6 m and 1000 m");
  if (!(within(x) && within(y) && within(rotation) && scale >= 0.5 && scale <= 2))
    throw invalidPlane("texture_to_plane is out of range");
  if (!share(info.glossAlpha)) throw invalidPlane("gloss_alpha must be 0 to 1");
  if (!share(info.f0)) throw invalidPlane("f0 must be 0 to 1");
  return info;
}

/** Throws DecodeError for bytes that are not a message and for a message that violates the specification; unknown
 *  fields are ignored. */
export function decodePlaneUpdate(bytes: Uint8Array): PlaneUpdate {
  if (bytes.length > maxPlaneMessageBytes) throw new DecodeError("data_loss", "plane update: longer than 64 KiB");
  const plain = { capture: 0, midExposureNs: 0n, size: 0 };
  const raw = { version: 0, units: 0, edge: 0, lumisphere: 0, coverage: 0, keyInterval: 0 };
  const gloss: { glossAlpha: number | null; f0: number | null } = { glossAlpha: null, f0: null };
  let revision = 0n;
  let pose: PoseMessage | null = null;
  let similarity: PlaneSimilarity | null = null;
  const tileRevision: bigint[] = [];
  const tiles: TileMessage[] = [];
  // Parse all bytes before validating values, so that a truncated message is data_loss, whatever its content.
  new WireReader(bytes, 0, bytes.length, 0, "plane update").fields({
    1: uint32((v) => (raw.version = v)),
    2: fixed32((v) => (plain.capture = v)),
    3: uint64((v) => (revision = v)),
    4: fixed64((v) => (plain.midExposureNs = BigInt.asIntN(64, v))),
    5: uint32((v) => (raw.units = v)),
    6: double((v) => (plain.size = v)),
    7: message((part) => (pose ??= new PoseMessage()).read(part)),
    8: message((part) => {
      const s = (similarity ??= { x: 0, y: 0, rotation: 0, scale: 0 });
      part.fields({
        1: double((v) => (s.x = v)),
        2: double((v) => (s.y = v)),
        3: double((v) => (s.rotation = v)),
        4: double((v) => (s.scale = v)),
      });
    }),
    9: float((v) => (gloss.glossAlpha = v)),
    10: float((v) => (gloss.f0 = v)),
    11: uint32((v) => (raw.edge = v)),
    12: uint32((v) => (raw.lumisphere = v)),
    13: uint32((v) => (raw.coverage = v)),
    14: uint32((v) => (raw.keyInterval = v)),
    15: repeatedUint64((v) => tileRevision.push(v)),
    16: message((part) => tiles.push(new TileMessage().read(part))),
  });
  if (raw.version !== 1) throw invalidPlane(`wire_version is ${raw.version}, this reader knows 1`);
  if (raw.units !== 1 && raw.units !== 2) throw invalidPlane("units are not known");
  const info = infoChecked({
    ...plain,
    ...gloss,
    units: raw.units === 1 ? "relative" : "absolute",
    pose: (pose as PoseMessage | null)?.get("T_probe_plane", invalidPlane) ?? null,
    textureToPlane: similarity ?? { x: 0, y: 0, rotation: 0, scale: 1 },
  });
  if (revision === 0n) throw invalidPlane("revision is 0");
  if (raw.keyInterval === 0) throw invalidPlane("key_interval_ms is 0");
  if (raw.edge > maxTextureEdge) throw invalidPlane("texture_edge is above 256");
  for (const levels of [raw.lumisphere, raw.coverage])
    if (levels < 1 || levels > maxLevels) throw invalidPlane("lumisphere_levels and coverage_levels must be 1 to 128");
  const layout = new PlaneTileLayout(raw.edge, raw.lumisphere, raw.coverage);
  if (tileRevision.length !== layout.size) throw invalidPlane("tile_revision has not one number for each tile");
  if (tileRevision.some((r) => r > revision)) throw invalidPlane("tile_revision: a number is above revision");
  if (tiles.length > layout.size) throw invalidPlane("tiles: one comes twice");
  const decoded = tiles.map((tile) => tile.get(layout, tileRevision));
  if (new Set(decoded.map((tile) => tile.index)).size !== decoded.length) throw invalidPlane("tiles: one comes twice");
  return { info, revision, keyIntervalMs: raw.keyInterval, layout, tileRevision, tiles: decoded };
}
