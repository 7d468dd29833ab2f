// The coverage of a captured plane: from where it was seen, and where to move next.
//   PlaneStream   the messages of /v1/planes; reconnects by itself
//   PlaneView     numbers and the disc
import { cleared } from "./estimator_views.js";
import { element, percent, putPairs, short, whole } from "./format.js";
import { DecodeError, PlaneCoverageReader, encodeLinkRequest, rotate } from "./sdk/lightwell.js";

const retryMs = 1000;
const responseTag = 0x0d;
/** The probe refuses this client. */
const policyViolation = 1008;
/** Directions closer to the plane do not count. As in proto/include/lightwell/plane_guidance.hpp. */
const minElevation = (10 * Math.PI) / 180;
const enough = { seen: 0.9, gap: (15 * Math.PI) / 180 };
/** Of nodes that are compared with each other for the largest gap; the error is one spacing of these. */
const sampled = 900;

class PlaneStream {
  /** onCoverage is called with each state. */
  constructor(address, token, onCoverage) {
    Object.assign(this, { address, token, onCoverage });
    this.refused = 0;
    this.closed = false;
    this.open();
  }

  open() {
    if (this.closed) return;
    const socket = new WebSocket(`${this.address}/v1/planes`, ["lightwell.v1"]);
    const reader = new PlaneCoverageReader();
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      if (this.token !== null) socket.send(encodeLinkRequest(1, { ask: "authenticate", token: this.token }));
    };
    socket.onmessage = ({ data }) => {
      const bytes = new Uint8Array(data);
      if (bytes[0] === responseTag) return;
      try {
        this.onCoverage(reader.take(bytes));
      } catch (cause) {
        if (!(cause instanceof DecodeError)) throw cause;
        ++this.refused;
      }
    };
    socket.onclose = ({ code }) => {
      if (!this.closed && code !== policyViolation) setTimeout(() => this.open(), retryMs);
    };
    this.socket = socket;
  }

  close() {
    this.closed = true;
    this.socket.close();
  }
}

/** Angles, solid angle and place on the disc of each node. */
function nodesOf(levels) {
  const spacing = Math.PI / (2 * levels);
  const nodes = [];
  for (let i = 0; i <= levels; ++i) {
    const theta = i * spacing;
    const count = i === 0 ? 1 : 4 * i;
    const low = Math.max(0, theta - spacing / 2);
    const high = Math.min(Math.PI / 2, theta + spacing / 2);
    const solidAngle = (2 * Math.PI * (Math.cos(low) - Math.cos(high))) / count;
    for (let j = 0; j < count; ++j) {
      const phi = (2 * Math.PI * j) / count;
      const radius = Math.tan(theta / 2);
      nodes.push({
        direction: [Math.sin(theta) * Math.cos(phi), Math.sin(theta) * Math.sin(phi), Math.cos(theta)],
        disc: [radius * Math.cos(phi), radius * Math.sin(phi)],
        solidAngle,
        counts: theta <= Math.PI / 2 - minElevation + 1e-9,
      });
    }
  }
  return nodes;
}

/** Share of the directions that count that was seen, and the unseen one that is farthest from all seen ones. */
function guidance(nodes, seen) {
  let all = 0;
  let covered = 0;
  const open = [];
  const known = [];
  nodes.forEach((node, i) => {
    if (seen[i]) known.push(node.direction);
    if (!node.counts) return;
    all += node.solidAngle;
    if (seen[i]) covered += node.solidAngle;
    else open.push(node);
  });
  const thin = (list) => list.filter((_, i) => i % Math.max(1, Math.ceil(list.length / sampled)) === 0);
  const reference = thin(known);
  let next = null;
  let gap = 0;
  for (const node of thin(open)) {
    const nearest = reference.reduce((most, d) =>
      Math.max(most, d[0] * node.direction[0] + d[1] * node.direction[1] + d[2] * node.direction[2]), -1);
    const angle = Math.acos(Math.min(1, nearest));
    if (angle > gap) [gap, next] = [angle, node];
  }
  return { seen: covered / all, gap, next: known.length ? next : nodes[0] };
}

export class PlaneView {
  constructor(address, token) {
    this.coverage = null;
    this.changed = false;
    this.stream = new PlaneStream(address, token, (coverage) => {
      this.coverage = coverage;
      this.changed = true;
    });
  }

  close() {
    this.stream.close();
  }

  /** Called a few times a second. */
  update() {
    if (!this.changed) return;
    this.changed = false;
    const { coverage } = this;
    if (this.levels !== coverage.levels) {
      this.levels = coverage.levels;
      this.nodes = nodesOf(coverage.levels);
    }
    const { seen, gap, next } = guidance(this.nodes, coverage.seen);
    const done = seen >= enough.seen && gap <= enough.gap;
    putPairs(element("plane-facts"), [
      ["Seen", percent(seen)],
      ["Largest gap", `${((gap * 180) / Math.PI).toFixed(0)}°`],
      ["Capture", done ? "✓ enough was seen" : "keep moving"],
      ["Gloss (GGX alpha)", coverage.glossAlpha === null ? "not known yet" : short(coverage.glossAlpha)],
      ["Side", `${short(coverage.sizeM)} m`],
      ["Texture", coverage.textureEdge ? `${coverage.textureEdge} texels a side` : "stays in the probe"],
      ["Update", whole(coverage.revision)],
    ]);
    this.draw(next);
    element("plane-disc").setAttribute("aria-label", `Coverage disc: ${percent(seen)} seen`);
  }

  draw(next) {
    const { c, edge, ratio } = cleared(element("plane-disc"));
    const { nodes, coverage } = this;
    const radius = edge / 2 - 8 * ratio;
    const at = ([x, y]) => [edge / 2 + radius * x, edge / 2 - radius * y];
    const dot = Math.max(1.5 * ratio, (radius * Math.PI) / (2.4 * coverage.levels) / 2);
    nodes.forEach((node, i) => {
      const [x, y] = at(node.disc);
      c.fillStyle = coverage.seen[i] ? "#f3b13c" : "#34373e";
      const size = coverage.seen[i] ? 2 * dot : dot;
      c.fillRect(x - size / 2, y - size / 2, size, size);
    });
    c.lineWidth = 2 * ratio;
    c.strokeStyle = "#a8a399";
    c.beginPath();
    c.arc(edge / 2, edge / 2, radius * Math.tan((Math.PI / 2 - minElevation) / 2), 0, 2 * Math.PI);
    c.stroke();
    if (next) this.cross(c, at(next.disc), 7 * ratio, ratio);
    if (coverage.pose) this.viewer(c, at, coverage.pose, ratio);
  }

  cross(c, [x, y], size, ratio) {
    for (const [style, width] of [["#000", 6], ["#fff", 3]]) {
      c.strokeStyle = style;
      c.lineWidth = width * ratio;
      c.beginPath();
      c.moveTo(x - size, y - size);
      c.lineTo(x + size, y + size);
      c.moveTo(x + size, y - size);
      c.lineTo(x - size, y + size);
      c.stroke();
    }
  }

  /** A ring where the camera was at the newest frame that contributed. */
  viewer(c, at, { rotation: [x, y, z, w], translation }, ratio) {
    const d = rotate([-x, -y, -z, w], translation.map((v) => -v));
    const length = Math.hypot(...d);
    if (!(length > 0) || d[2] <= 0) return;
    const k = 1 / (length + d[2]);
    for (const [style, width] of [["#000", 6], ["#fff", 3]]) {
      c.strokeStyle = style;
      c.lineWidth = width * ratio;
      c.beginPath();
      c.arc(...at([d[0] * k, d[1] * k]), 7 * ratio, 0, 2 * Math.PI);
      c.stroke();
    }
  }
}
