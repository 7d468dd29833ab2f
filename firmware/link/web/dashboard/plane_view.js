// The coverage of a captured plane: from where it was seen, and where to move next.
//   PlaneStream   the messages of /v1/planes; reconnects by itself
//   PlaneView     numbers and the disc
import { cleared } from "./estimator_views.js";
import { element, percent, putPairs, short, whole } from "./format.js";
import { encodeLinkRequest } from "./sdk/link_message.js";
import { guidanceDiscRadius, probeDirection, stereographic } from "./sdk/plane_guidance.js";
import { PlaneReader } from "./sdk/plane_reader.js";
import { DecodeError } from "./sdk/wire.js";

const retryMs = 1000;
const responseTag = 0x0d;
/** The probe refuses this client. */
const policyViolation = 1008;

/** Keeps the plane that the messages of /v1/planes describe. */
class PlaneStream {
  constructor(address, token) {
    Object.assign(this, { address, token });
    this.refused = 0;
    this.closed = false;
    this.reader = new PlaneReader();
    this.open();
  }

  open() {
    if (this.closed) return;
    const socket = new WebSocket(`${this.address}/v1/planes`, ["lightwell.v1"]);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      if (this.token !== null) socket.send(encodeLinkRequest(1, { ask: "authenticate", token: this.token }));
    };
    socket.onmessage = ({ data }) => {
      const bytes = new Uint8Array(data);
      if (bytes[0] === responseTag) return;
      try {
        this.reader.take(bytes, performance.now());
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

export class PlaneView {
  constructor(address, token) {
    this.stream = new PlaneStream(address, token);
  }

  close() {
    this.stream.close();
  }

  /** Called a few times a second. */
  update() {
    const plane = this.stream.reader.snapshot(performance.now());
    if (plane.info === null || plane.revision === this.revision) return;
    this.revision = plane.revision;
    const { seen, gap, next, progress } = plane.guidance();
    const { info } = plane;
    putPairs(element("plane-facts"), [
      ["Seen", percent(seen)],
      ["Largest gap", `${((gap * 180) / Math.PI).toFixed(0)}°`],
      ["Capture", progress === "enough" ? "✓ enough was seen" : "keep moving"],
      ["Gloss (GGX alpha)", info.glossAlpha === null ? "not known yet" : short(info.glossAlpha)],
      ["Side", `${short(info.size)} m`],
      ["Texture", plane.textureEdge ? `${plane.textureEdge} texels a side` : "stays in the probe"],
      ["Update", whole(plane.revision)],
    ]);
    this.draw(plane, next);
    element("plane-disc").setAttribute("aria-label", `Coverage disc: ${percent(seen)} seen`);
  }

  draw(plane, next) {
    const { c, edge, ratio } = cleared(element("plane-disc"));
    const { grid, seen } = plane.coverage;
    const radius = edge / 2 - 8 * ratio;
    const at = ([x, y]) => [edge / 2 + radius * x, edge / 2 - radius * y];
    const dot = Math.max(1.5 * ratio, (radius * Math.PI) / (2.4 * grid.levels) / 2);
    for (let node = 0; node < grid.size; ++node) {
      const [x, y] = at(stereographic(grid.direction(node)));
      c.fillStyle = seen[node] ? "#f3b13c" : "#34373e";
      const size = seen[node] ? 2 * dot : dot;
      c.fillRect(x - size / 2, y - size / 2, size, size);
    }
    c.lineWidth = 2 * ratio;
    c.strokeStyle = "#a8a399";
    c.beginPath();
    c.arc(edge / 2, edge / 2, radius * guidanceDiscRadius(), 0, 2 * Math.PI);
    c.stroke();
    if (next !== null) this.cross(c, at(stereographic(next)), 7 * ratio, ratio);
    const viewer = probeDirection(plane.info);
    if (viewer !== null) this.viewer(c, at(stereographic(viewer)), ratio);
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
  viewer(c, [x, y], ratio) {
    for (const [style, width] of [["#000", 6], ["#fff", 3]]) {
      c.strokeStyle = style;
      c.lineWidth = width * ratio;
      c.beginPath();
      c.arc(x, y, 7 * ratio, 0, 2 * Math.PI);
      c.stroke();
    }
  }
}
