// Guidance of a capture: from how many of the directions that count a plane was seen, and where to move next.
// proto/include/lightwell/plane_guidance.hpp.
import { HemisphereGrid } from "./hemisphere_grid.js";
import { PlaneInfo } from "./plane_update.js";
import { Vec3, dot, inverse, normalized, rotate } from "./vector.js";

export interface PlaneGuidanceOptions {
  /** Directions closer to the plane do not count, rad. Default: 10 degrees. */
  minElevation?: number;
  /** Enough is seen where `seen` is at least this (default: 0.9) ... */
  minSeen?: number;
  /** ... and `gap` at most this, rad. Default: 15 degrees. */
  maxGap?: number;
}

export interface PlaneGuidance {
  /** Share of the solid angle of the directions that count that was seen. */
  seen: number;
  progress: "keep_moving" | "enough";
  /** Where to move next: unit vector towards the viewer, in the plane's frame; null: all was seen. */
  next: Vec3 | null;
  /** Its angle from the nearest seen direction, rad. */
  gap: number;
}

/** Directions towards the viewer from which frames were taken. */
export interface PlaneCoverage {
  grid: HemisphereGrid;
  /** 0 or 1 for each node. */
  seen: Uint8Array;
}

const degree = Math.PI / 180;

/** Nodes at the other ends of the edges at a node of the lattice. */
function neighbours(grid: HemisphereGrid, of: number): number[] {
  const level = grid.levelOf(of);
  const at = of - HemisphereGrid.firstOf(level);
  const node = (of: number, k: number) => {
    const nodes = HemisphereGrid.nodesOf(of);
    return HemisphereGrid.firstOf(of) + ((k + nodes) % nodes);
  };
  if (level === 0) return [0, 1, 2, 3].map((k) => node(1, k));
  const quarter = Math.floor(at / level);
  const along = at % level;
  const out = [node(level, at - 1), node(level, at + 1)];
  if (level < grid.levels) {
    const below = quarter * (level + 1) + along;
    out.push(node(level + 1, below), node(level + 1, below + 1));
    if (along === 0) out.push(node(level + 1, below - 1));
  }
  const above = quarter * (level - 1) + along;
  out.push(node(level - 1, above));
  if (along !== 0) out.push(node(level - 1, above - 1));
  return out;
}

/** For each node the nearest seen one, propagated from node to node; -1 where none was seen. */
function nearestSeen({ grid, seen }: PlaneCoverage, direction: readonly Vec3[]): Int32Array {
  const seed = new Int32Array(direction.length).fill(-1);
  let queue: number[] = [];
  seen.forEach((s, n) => {
    if (s === 0) return;
    seed[n] = n;
    queue.push(n);
  });
  while (queue.length > 0) {
    const next: number[] = [];
    for (const from of queue)
      for (const to of neighbours(grid, from)) {
        const d = direction[to];
        if (seed[to] >= 0 && !(dot(d, direction[seed[from]]) > dot(d, direction[seed[to]]))) continue;
        seed[to] = seed[from];
        next.push(to);
      }
    queue = next;
  }
  return seed;
}

function angleBetween(a: Vec3, b: Vec3): number {
  const cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  return Math.atan2(Math.sqrt(cross[0] ** 2 + cross[1] ** 2 + cross[2] ** 2), dot(a, b));
}

const clampedElevation = (options: PlaneGuidanceOptions) =>
  Math.min(Math.max(options.minElevation ?? 10 * degree, 0), Math.PI / 2);

export function planeGuidance(coverage: PlaneCoverage, options: PlaneGuidanceOptions = {}): PlaneGuidance {
  const { grid, seen } = coverage;
  const direction = Array.from({ length: grid.size }, (_, n) => grid.direction(n));
  const seed = nearestSeen(coverage, direction);
  const lowest = Math.sin(clampedElevation(options)) - 1e-9;
  let all = 0;
  let seenAngle = 0;
  let farthest = -1;
  let gap = 0;
  for (let n = 0; n < grid.size; ++n) {
    if (direction[n][2] < lowest) continue;
    const angle = grid.solidAngle(n);
    all += angle;
    if (seen[n] !== 0) {
      seenAngle += angle;
      continue;
    }
    const own = seed[n] < 0 ? Math.PI : angleBetween(direction[n], direction[seed[n]]);
    if (own <= gap) continue;
    gap = own;
    farthest = n;
  }
  const share = all > 0 ? seenAngle / all : 0;
  const enough = share >= (options.minSeen ?? 0.9) && gap <= (options.maxGap ?? 15 * degree);
  return {
    seen: share, progress: enough ? "enough" : "keep_moving", next: farthest < 0 ? null : direction[farthest], gap,
  };
}

/** Radius on the unit disc of the circle of directions that count. */
export function guidanceDiscRadius(options: PlaneGuidanceOptions = {}): number {
  return Math.tan((Math.PI / 2 - clampedElevation(options)) / 2);
}

/** Position of a direction on the unit disc (stereographic), for a drawing of the coverage. */
export function stereographic(direction: Vec3): [number, number] {
  return [direction[0] / (1 + direction[2]), direction[1] / (1 + direction[2])];
}

/** Unit vector from the plane to where the newest frame that contributed was taken, in the plane's frame; null: not
 *  known, or behind the plane. */
export function probeDirection(info: PlaneInfo): Vec3 | null {
  if (info.pose === null) return null;
  const back = rotate(inverse(info.pose.rotation), info.pose.translation);
  const d = normalized(back.map((v) => -v) as Vec3);
  return d !== null && d[2] > 0 ? d : null;
}
