// Collects the messages of a captured plane: host_sdk/src/core/plane_reader.cpp.
import { HemisphereGrid } from "./hemisphere_grid.js";
import { PlaneAppearance } from "./plane_appearance.js";
import { PlaneInfo, PlaneTile, PlaneTileLayout, PlaneUpdate, decodePlaneUpdate, invalidPlane } from "./plane_update.js";

/** What a PlaneReader holds. A tile is the newest one if held equals listed. */
export interface PlaneState {
  info: PlaneInfo;
  revision: bigint;
  keyIntervalMs: number;
  receivedMs: number;
  layout: PlaneTileLayout;
  /** By tile: revision of the newest content of which a message told, and of what is held. */
  listed: bigint[];
  held: bigint[];
  missing: number;
  /** D: r, g, b and the SampleState of each texel, rows from the top. */
  texture: { radiance: Float32Array; state: Uint8Array };
  /** S, by node of its grid. */
  lumisphere: { grid: HemisphereGrid; radiance: Float32Array; state: Uint8Array };
  coverage: { grid: HemisphereGrid; seen: Uint8Array };
}

const formerCaptures = 4;

function emptyState(update: PlaneUpdate): PlaneState {
  const { layout } = update;
  const texels = layout.textureEdge ** 2;
  const lumisphere = new HemisphereGrid(layout.lumisphereLevels);
  const coverage = new HemisphereGrid(layout.coverageLevels);
  return {
    info: update.info,
    revision: 0n,
    keyIntervalMs: update.keyIntervalMs,
    receivedMs: -Infinity,
    layout,
    listed: new Array<bigint>(layout.size).fill(0n),
    held: new Array<bigint>(layout.size).fill(0n),
    missing: 0,
    texture: { radiance: new Float32Array(3 * texels), state: new Uint8Array(texels) },
    lumisphere: {
      grid: lumisphere, radiance: new Float32Array(3 * lumisphere.size), state: new Uint8Array(lumisphere.size),
    },
    coverage: { grid: coverage, seen: new Uint8Array(coverage.size) },
  };
}

/** Revisions of tiles never fall from one update to the next. */
function checkOrder(held: PlaneState, update: PlaneUpdate): void {
  if (!update.layout.equals(held.layout)) throw invalidPlane("other sizes than before in the same capture");
  const newer = update.revision > held.revision;
  const least = newer ? held.revision : update.revision;
  held.listed.forEach((listed, t) => {
    const a = newer ? listed : update.tileRevision[t];
    const b = newer ? update.tileRevision[t] : listed;
    // What changed after an update is not in that update.
    if (a > b || (update.revision === held.revision && a !== b) || (a !== b && b <= least))
      throw invalidPlane("tile_revision contradicts an earlier message");
  });
}

function store(tile: PlaneTile, state: PlaneState): void {
  const part = state.layout.part(tile.index);
  tile.state.forEach((s, k) => {
    const at = state.layout.entry(tile.index, k);
    if (part === "coverage") {
      state.coverage.seen[at] = s;
      return;
    }
    state[part].radiance.set(tile.radiance.subarray(3 * k, 3 * k + 3), 3 * at);
    state[part].state[at] = s;
  });
}

/** Collects the messages of one captured plane from one source. Order, duplicates and losses do not matter: a tile that
 *  did not arrive is noticed with the next message, and arrives again within the key interval. */
export class PlaneReader {
  private state: PlaneState | null = null;
  private published: PlaneState | null = null;
  private former: number[] = [];
  /** Messages taken, and refused. */
  messages = 0;
  refused = 0;

  /** One message; `nowMs` is the time by the application's clock, in which snapshot() is asked, too. Throws DecodeError
   *  for bytes that decodePlaneUpdate() refuses, for a message that contradicts earlier ones of its capture, and for
   *  one of the four captures before this one; then nothing has changed. */
  take(message: Uint8Array, nowMs: number): void {
    try {
      this.apply(decodePlaneUpdate(message), nowMs);
      ++this.messages;
    } catch (error) {
      ++this.refused;
      throw error;
    }
  }

  /** Whether a message was received, and no tile of the newest update is missing. */
  get complete(): boolean {
    return this.state !== null && this.state.missing === 0;
  }

  /** The plane as received so far, which later messages do not change. Copies it if it changed since the last one. */
  snapshot(nowMs: number): PlaneAppearance {
    if (this.state !== null && this.published === null) {
      const { texture, lumisphere, coverage, held, listed } = this.state;
      this.published = {
        ...this.state,
        held: held.slice(),
        listed: listed.slice(),
        texture: { radiance: texture.radiance.slice(), state: texture.state.slice() },
        lumisphere: { ...lumisphere, radiance: lumisphere.radiance.slice(), state: lumisphere.state.slice() },
        coverage: { ...coverage, seen: coverage.seen.slice() },
      };
    }
    return new PlaneAppearance(this.published, nowMs);
  }

  private apply(update: PlaneUpdate, nowMs: number): void {
    const { capture } = update.info;
    if (this.state === null || capture !== this.state.info.capture) {
      if (this.former.includes(capture)) throw invalidPlane("of a former capture");
      if (this.state !== null) this.former = [...this.former, this.state.info.capture].slice(-formerCaptures);
      this.state = emptyState(update);
    } else {
      checkOrder(this.state, update);
    }
    const { state } = this;
    this.published = null;
    state.receivedMs = Math.max(state.receivedMs, nowMs);
    if (update.revision > state.revision) {
      state.info = update.info;
      state.revision = update.revision;
      state.keyIntervalMs = update.keyIntervalMs;
      state.listed = update.tileRevision.slice();
    }
    for (const tile of update.tiles) {
      const revision = update.tileRevision[tile.index];
      if (revision !== state.listed[tile.index] || revision === state.held[tile.index]) continue;
      store(tile, state);
      state.held[tile.index] = revision;
    }
    state.missing = state.held.filter((revision, t) => revision !== state.listed[t]).length;
  }
}
