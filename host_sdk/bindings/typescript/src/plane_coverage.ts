// Of a captured plane's stream (PlaneUpdate) what guides the capture: from where the plane was seen. Texture and
// lumisphere are skipped. Specification: proto/README.md, "Captured planes".
import { PoseMessage } from "./descriptor.js";
import type { Pose } from "./vector.js";
import {
  DecodeError, WireReader, byteString, double, fixed32, float, message, repeatedUint32, uint32, uint64,
} from "./wire.js";

export const maxPlaneMessageBytes = 65536;
const maxLevels = 128;
const maxTextureEdge = 256;
const textureTileEdge = 32;
const lumisphereTileNodes = 1024;
const coverageTileNodes = 8192;

const invalid = (what: string) => new DecodeError("invalid_argument", `plane update: ${what}`);

/** Directions of a hemisphere: level i = 0 to n at theta = i pi / 2n from the normal, with 4 i nodes (level 0: one) at
 *  phi = 2 pi j / 4i from +X towards +Y, numbered level by level. */
export const hemisphereNodes = (levels: number) => 1 + 2 * levels * (levels + 1);

export interface PlaneCoverage {
  capture: number;
  revision: bigint;
  /** Side of the captured square, m. */
  sizeM: number;
  /** T_probe_plane at the newest frame that contributed; null if not known. */
  pose: Pose | null;
  /** GGX alpha of the gloss; null if not known. */
  glossAlpha: number | null;
  /** Texels along a side; 0 if images do not leave the probe. */
  textureEdge: number;
  levels: number;
  /** One element for each node of the hemisphere, 1: seen. */
  seen: Uint8Array;
}

interface Tile {
  index: number;
  states: Uint8Array;
}

/** Assembles the coverage from the messages of one stream. */
export class PlaneCoverageReader {
  private coverage: PlaneCoverage | null = null;
  /** Revision in which each tile of the coverage last changed. */
  private tileRevisions: number[] = [];

  /** Processes one message, and returns what is known after it. Throws DecodeError, and keeps what it has. */
  take(bytes: Uint8Array): PlaneCoverage {
    if (bytes.length > maxPlaneMessageBytes) throw new DecodeError("data_loss", "plane update: longer than 64 KiB");
    const raw = { version: 0, units: 0, lumisphere: 0 };
    const next = { capture: 0, revision: 0n, sizeM: 0, glossAlpha: null as number | null, textureEdge: 0, levels: 0 };
    let pose: PoseMessage | null = null;
    const revisions: number[] = [];
    const tiles: Tile[] = [];
    new WireReader(bytes).fields({
      1: uint32((v) => (raw.version = v)),
      2: fixed32((v) => (next.capture = v)),
      3: uint64((v) => (next.revision = v)),
      5: uint32((v) => (raw.units = v)),
      6: double((v) => (next.sizeM = v)),
      7: message((part) => (pose ??= new PoseMessage()).read(part)),
      9: float((v) => (next.glossAlpha = v)),
      11: uint32((v) => (next.textureEdge = v)),
      12: uint32((v) => (raw.lumisphere = v)),
      13: uint32((v) => (next.levels = v)),
      15: repeatedUint32((v) => revisions.push(v)),
      16: message((part) => {
        const tile: Tile = { index: 0, states: new Uint8Array(0) };
        part.fields({ 1: uint32((v) => (tile.index = v)), 4: byteString((v) => (tile.states = v)) });
        tiles.push(tile);
      }),
    });
    if (raw.version !== 1) throw invalid(`wire_version is ${raw.version}, this reader knows 1`);
    if (next.capture === 0) throw invalid("capture is 0");
    if (next.revision === 0n) throw invalid("revision is 0");
    if (raw.units !== 1 && raw.units !== 2) throw invalid("units are not known");
    if (!(next.sizeM >= 1e-6 && next.sizeM <= 1000)) throw invalid("size_m must be 1e-6 to 1000");
    if (next.textureEdge > maxTextureEdge) throw invalid("texture_edge is above 256");
    for (const levels of [raw.lumisphere, next.levels])
      if (levels < 1 || levels > maxLevels) throw invalid("levels must be 1 to 128");
    const first = Math.ceil(next.textureEdge / textureTileEdge) ** 2 +
      Math.ceil(hemisphereNodes(raw.lumisphere) / lumisphereTileNodes);
    const nodes = hemisphereNodes(next.levels);
    const own = Math.ceil(nodes / coverageTileNodes);
    if (revisions.length !== first + own) throw invalid("tile_revision: the number does not match the sizes");
    for (const { index, states } of tiles) {
      if (index >= first + own) throw invalid("tiles: an index is too large");
      if (index < first) continue;
      const entries = Math.min(coverageTileNodes, nodes - (index - first) * coverageTileNodes);
      if (states.length !== Math.ceil(entries / 8)) throw invalid("tiles: the length does not match the entries");
    }
    const known = (pose as PoseMessage | null)?.get() ?? null;
    const coverage = tiles.filter(({ index }) => index >= first).map((t) => ({ ...t, index: t.index - first }));
    return this.store({ ...next, pose: known, seen: new Uint8Array(nodes) }, revisions.slice(first), coverage);
  }

  private store(next: PlaneCoverage, revisions: number[], tiles: readonly Tile[]): PlaneCoverage {
    const same = this.coverage?.capture === next.capture && this.coverage.levels === next.levels;
    if (same) next.seen = this.coverage!.seen.slice();
    for (const { index, states } of tiles) {
      // An older message that was overtaken.
      if (same && revisions[index] < this.tileRevisions[index]) continue;
      const begin = index * coverageTileNodes;
      const end = Math.min(begin + coverageTileNodes, next.seen.length);
      for (let i = begin; i < end; ++i) next.seen[i] = (states[(i - begin) >> 3] >> ((i - begin) & 7)) & 1;
    }
    this.tileRevisions = revisions;
    return (this.coverage = next);
  }
}
