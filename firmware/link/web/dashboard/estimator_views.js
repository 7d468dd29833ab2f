// What one kind of estimator alone has: the pose of a marker, the coverage of a plane.
import { degrees, element, put, putPairs, short } from "./format.js";
import { rotate } from "./sdk/vector.js";

const trailLength = 90;

/** A square canvas, cleared, with its context, size and pixel ratio. */
export function cleared(canvas) {
  const ratio = Math.min(2, window.devicePixelRatio || 1);
  const edge = Math.max(1, Math.round(canvas.clientWidth * ratio));
  if (canvas.width !== edge || canvas.height !== edge) canvas.width = canvas.height = edge;
  const c = canvas.getContext("2d");
  c.clearRect(0, 0, edge, edge);
  return { c, edge, ratio };
}

/** The marker's pose (T_probe_origin) in numbers and seen from above. */
export class MarkerView {
  constructor() {
    this.trail = [];
  }

  add({ origin }) {
    this.trail.push(origin.translation);
    if (this.trail.length > trailLength) this.trail.shift();
  }

  update(lighting) {
    const found = lighting.validity === "valid";
    element("marker-mark").dataset.good = found ? "yes" : "no";
    put("marker-found", found ? "In view" : `Not in view for ${short(lighting.ageMs / 1000)} s`);
    const { translation: [x, y, z], rotation } = lighting.descriptor.origin;
    const up = rotate(rotation, [0, 1, 0]);
    putPairs(element("marker-pose"), [
      ["Right, x", `${short(x)} m`], ["Up, y", `${short(y)} m`], ["Ahead, −z", `${short(-z)} m`],
      ["Distance", `${short(Math.hypot(x, y, z))} m`],
      ["Tilt of its +Y from up", degrees(Math.acos(Math.min(1, Math.max(-1, up[1]))))],
    ]);
    this.draw(found, lighting.descriptor.origin);
  }

  draw(found, { translation, rotation }) {
    const { c, edge, ratio } = cleared(element("marker-map"));
    const far = Math.max(0.3, ...this.trail.map(([x, , z]) => Math.max(2 * Math.abs(x), Math.abs(z)))) * 1.2;
    const at = ([x, , z]) => [edge / 2 + (x / far) * edge, edge * 0.94 + (z / far) * edge * 0.94];
    c.lineWidth = 2 * ratio;
    c.strokeStyle = c.fillStyle = "#a8a399";
    c.font = `${11 * ratio}px system-ui, sans-serif`;
    c.textAlign = "center";
    c.beginPath();
    c.moveTo(edge / 2 - edge * 0.4, edge * 0.3);
    c.lineTo(edge / 2, edge * 0.94);
    c.lineTo(edge / 2 + edge * 0.4, edge * 0.3);
    c.stroke();
    c.fillText("camera", edge / 2, edge * 0.99);
    c.strokeStyle = "#f3b13c";
    c.beginPath();
    this.trail.forEach((p, i) => (i === 0 ? c.moveTo(...at(p)) : c.lineTo(...at(p))));
    c.stroke();
    const here = at(translation);
    const ahead = rotate(rotation, [0, 0, 0.12 * far]);
    c.fillStyle = found ? "#f3b13c" : "#0000";
    c.beginPath();
    c.arc(...here, 6 * ratio, 0, 2 * Math.PI);
    c.fill();
    c.stroke();
    c.beginPath();
    c.moveTo(...here);
    c.lineTo(...at(translation.map((v, k) => v + ahead[k])));
    c.stroke();
  }
}
