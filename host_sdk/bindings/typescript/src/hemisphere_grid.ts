// Discrete directions of a hemisphere: proto/include/lightwell/hemisphere_grid.hpp. Frame: that of a plane, +Z its
// normal; theta is the angle from +Z, phi the azimuth from +X to +Y.
import { Vec3 } from "./vector.js";

const f = Math.fround;

/** Three nodes around a direction with barycentric weights. */
export interface HemisphereInterpolation {
  node: Vec3;
  weight: Vec3;
}

/** atan2(y, x) in quarter turns, 0 to 1, for arguments of at least 0 that are not both zero, as in C++ (error 3e-6). */
function quarterTurn(y: number, x: number): number {
  const low = y < x ? y : x;
  const high = x < y ? y : x;
  const t = f(low / high);
  const t2 = f(t * t);
  let a = f(-0.0117212);
  for (const c of [0.05265332, -0.11643287, 0.19354346, -0.33262347]) a = f(f(a * t2) + f(c));
  a = f(f(f(f(a * t2) + f(0.99997726)) * t) * f(2 / f(Math.PI)));
  return y > x ? f(1 - a) : a;
}

/** Levels i = 0 to n at theta = i pi / (2 n); level 0 is one node, level i has 4 i nodes at phi = 2 pi j / (4 i). */
export class HemisphereGrid {
  readonly size: number;

  /** `levels`: 1 to 512. */
  constructor(readonly levels: number) {
    this.size = 1 + 2 * levels * (levels + 1);
  }

  /** Index of the first node of a level. */
  static firstOf(level: number): number {
    return level === 0 ? 0 : 1 + 2 * level * (level - 1);
  }

  static nodesOf(level: number): number {
    return level === 0 ? 1 : 4 * level;
  }

  /** rad */
  get spacing(): number {
    return Math.PI / (2 * this.levels);
  }

  levelOf(node: number): number {
    if (node === 0) return 0;
    let level = Math.floor((1 + Math.sqrt(1 + 2 * (node - 1))) / 2);
    while (level > 1 && HemisphereGrid.firstOf(level) > node) --level;
    while (level < this.levels && HemisphereGrid.firstOf(level + 1) <= node) ++level;
    return level;
  }

  /** Unit vector of a node. */
  direction(node: number): Vec3 {
    const level = this.levelOf(node);
    if (level === 0) return [0, 0, 1];
    const theta = level * this.spacing;
    const phi = ((Math.PI / 2) * (node - HemisphereGrid.firstOf(level))) / level;
    const ring = Math.sin(theta);
    return [ring * Math.cos(phi), ring * Math.sin(phi), level === this.levels ? 0 : Math.cos(theta)];
  }

  /** Solid angle of a node, sr. All nodes together have 2 pi. */
  solidAngle(node: number): number {
    const level = this.levelOf(node);
    const low = Math.max(0, (level - 0.5) * this.spacing);
    const high = Math.min(Math.PI / 2, (level + 0.5) * this.spacing);
    return (4 * Math.PI * Math.sin((low + high) / 2) * Math.sin((high - low) / 2)) / HemisphereGrid.nodesOf(level);
  }

  /** Linear in theta and, within a level, in phi. `direction` is finite with z > 0, and need not be normalised. Rounded
   *  to float as in C++, so that both choose the same nodes. */
  interpolate(direction: Vec3): HemisphereInterpolation {
    const [x, y, height] = direction.map(f);
    const ring = f(Math.sqrt(f(f(x * x) + f(y * y))));
    const theta = f(quarterTurn(ring, height) + f(0 * f(ring + height)));
    const row = f(Math.min(theta > 0 ? theta : 0, 1) * this.levels);
    const negative = (v: number) => v < 0 || Object.is(v, -0);
    const quarter = (negative(x) ? 1 : 0) ^ (negative(y) ? 3 : 0);
    const steep = quarterTurn(Math.abs(y), Math.abs(x));
    const turned = negative(x) !== negative(y) ? f(1 - steep) : steep;
    const column = f((turned > 0 ? turned : 0) * row);
    const i = Math.min(Math.trunc(row), this.levels - 1);
    const j = Math.min(Math.trunc(column), i);
    const fi = f(row - i);
    const fj = Math.min(f(column - j), 1);
    const down = fj <= fi ? 1 : 0;
    const larger = fi < fj ? fj : fi;
    const least = Math.min(fi, fj);
    const nodeAt = (level: number, along: number) => {
      const index = quarter * level + along;
      return level > 0 ? HemisphereGrid.firstOf(level) + (index >= 4 * level ? index - 4 * level : index) : 0;
    };
    return {
      node: [nodeAt(i, j), nodeAt(i + down, j + 1 - down), nodeAt(i + 1, j + 1)],
      weight: [f(1 - larger), f(larger - least), least],
    };
  }
}
