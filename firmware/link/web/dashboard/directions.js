// The sphere of directions in Hammer's equal-area projection: radiance, a grid, lights as dots with their 2 sigma
// ellipses.
import { degrees } from "./format.js";
import { luminance } from "./sdk/vector.js";

const width = 384;
const height = 192;
const root2 = Math.SQRT2;

/** Unit vector to the plane, x and y within 1; the centre is -Z, +X to the right, +Y up. */
export function project([x, y, z]) {
  const half = Math.atan2(x, -z) / 2;
  const cosine = Math.sqrt(Math.max(0, 1 - y * y));
  const k = Math.sqrt(1 + cosine * Math.cos(half));
  return [(cosine * Math.sin(half)) / k, y / k];
}

/** Fractions u, v of an equirectangular picture; null outside of the ellipse. */
function inverse(px, py) {
  if (px * px + py * py > 1) return null;
  const x = 2 * root2 * px;
  const y = root2 * py;
  const z = Math.sqrt(Math.max(0, 1 - (x / 4) ** 2 - (y / 2) ** 2));
  const longitude = 2 * Math.atan2(z * x, 2 * (2 * z * z - 1));
  const latitude = Math.asin(Math.min(1, Math.max(-1, z * y)));
  return [longitude / (2 * Math.PI) + 0.5, 0.5 - latitude / Math.PI];
}

const lookup = Array.from({ length: width * height }, (_, i) =>
  inverse((2 * ((i % width) + 0.5)) / width - 1, 1 - (2 * (Math.floor(i / width) + 0.5)) / height));

const fromAngles = (azimuth, elevation) => [
  Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation), -Math.cos(elevation) * Math.cos(azimuth),
];

/** The basis u, v of a light's covariance: proto/README.md, "Tangent basis". */
function tangentBasis([x, y, z]) {
  const s = z < 0 || Object.is(z, -0) ? -1 : 1;
  const a = -1 / (s + z);
  const b = x * y * a;
  return [[1 + s * x * x * a, s * b, -s * x], [b, s + y * y * a, -y]];
}

/** Points on the sphere around a light, `sigmas` standard deviations from it. */
export function ellipse({ direction, directionCovariance: [uu, uv, vv] }, sigmas, count = 40) {
  const [u, v] = tangentBasis(direction);
  const middle = (uu + vv) / 2;
  const spread = Math.hypot((uu - vv) / 2, uv);
  const turn = 0.5 * Math.atan2(2 * uv, uu - vv);
  const major = sigmas * Math.sqrt(Math.max(0, middle + spread));
  const minor = sigmas * Math.sqrt(Math.max(0, middle - spread));
  return Array.from({ length: count }, (_, i) => {
    const t = (2 * Math.PI * i) / count;
    const a = Math.min(1.5, major) * Math.cos(t);
    const b = Math.min(1.5, minor) * Math.sin(t);
    const alongU = a * Math.cos(turn) - b * Math.sin(turn);
    const alongV = a * Math.sin(turn) + b * Math.cos(turn);
    const angle = Math.hypot(alongU, alongV);
    const k = angle > 0 ? Math.sin(angle) / angle : 1;
    return direction.map((d, axis) => d * Math.cos(angle) + k * (alongU * u[axis] + alongV * v[axis]));
  });
}

/** Largest standard deviation of a light's direction, rad. */
export function directionSigma({ directionCovariance: [uu, uv, vv] }) {
  return Math.sqrt(Math.max(0, (uu + vv) / 2 + Math.hypot((uu - vv) / 2, uv)));
}

/** Azimuth from -Z towards +X, and elevation, rad. */
export const anglesOf = ([x, y, z]) => [Math.atan2(x, -z), Math.asin(Math.min(1, Math.max(-1, y)))];

export class DirectionsView {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.back = document.createElement("canvas");
    this.back.width = width;
    this.back.height = height;
    this.image = this.back.getContext("2d").createImageData(width, height);
  }

  setPanorama(panorama) {
    const { data } = this.image;
    lookup.forEach((uv, i) => {
      if (!uv) return;
      panorama.sample(uv[0], uv[1], data, 4 * i);
      data[4 * i + 3] = 255;
    });
    this.back.getContext("2d").putImageData(this.image, 0, 0);
  }

  draw(descriptor) {
    const { canvas, context: c } = this;
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const w = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const h = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== w || canvas.height !== h) Object.assign(canvas, { width: w, height: h });
    const scale = ratio;
    const margin = 22 * scale;
    const [rx, ry] = [w / 2 - margin, h / 2 - margin / 2];
    const at = (d) => {
      const [x, y] = project(d);
      return [w / 2 + rx * x, h / 2 - ry * y];
    };
    c.clearRect(0, 0, w, h);
    c.save();
    c.beginPath();
    c.ellipse(w / 2, h / 2, rx, ry, 0, 0, 2 * Math.PI);
    c.clip();
    c.imageSmoothingQuality = "high";
    c.drawImage(this.back, w / 2 - rx, h / 2 - ry, 2 * rx, 2 * ry);
    this.drawGrid(at, scale);
    c.restore();
    c.lineWidth = scale;
    c.strokeStyle = "rgba(255,255,255,.5)";
    c.beginPath();
    c.ellipse(w / 2, h / 2, rx, ry, 0, 0, 2 * Math.PI);
    c.stroke();
    this.drawNames(at, scale);
    // The strongest is drawn last, on top.
    [...descriptor.lights.entries()].reverse().forEach(([i, light]) => this.drawLight(light, i, at, scale, w));
    this.describe(descriptor);
  }

  drawGrid(at, scale) {
    const c = this.context;
    c.strokeStyle = "rgba(255,255,255,.2)";
    c.lineWidth = scale;
    const line = (points) => {
      c.beginPath();
      points.forEach((d, i) => (i === 0 ? c.moveTo(...at(d)) : c.lineTo(...at(d))));
      c.stroke();
    };
    const steps = Array.from({ length: 61 }, (_, i) => i / 60);
    for (let k = -2; k <= 2; ++k)
      line(steps.map((t) => fromAngles((2 * t - 1) * Math.PI * 0.9999, (k * Math.PI) / 6)));
    for (let k = -3; k <= 3; ++k)
      line(steps.map((t) => fromAngles((k * Math.PI) / 4, ((2 * t - 1) * Math.PI) / 2)));
  }

  drawNames(at, scale) {
    const c = this.context;
    c.font = `600 ${11 * scale}px system-ui, sans-serif`;
    c.textAlign = "center";
    c.textBaseline = "middle";
    c.lineWidth = 3 * scale;
    c.strokeStyle = "rgba(0,0,0,.65)";
    c.fillStyle = "#fff";
    for (const [text, d] of [["front −Z", fromAngles(0, -0.1)], ["right +X", fromAngles(Math.PI / 2, -0.1)],
                             ["left −X", fromAngles(-Math.PI / 2, -0.1)], ["up +Y", fromAngles(0, 1.35)],
                             ["down −Y", fromAngles(0, -1.35)]]) {
      c.strokeText(text, ...at(d));
      c.fillText(text, ...at(d));
    }
  }

  drawLight(light, index, at, scale, w) {
    const c = this.context;
    const [x, y] = at(light.direction);
    // Two strokes, dark below light, are visible on any radiance.
    const outline = (points) => {
      for (const [style, line] of [["#000", 4], ["#fff", 2]]) {
        c.strokeStyle = style;
        c.lineWidth = line * scale;
        c.beginPath();
        let last = null;
        points.map(at).forEach(([px, py], i) => {
          // Not across the back, where the map is cut.
          if (i === 0 || Math.abs(px - last) > w / 3) c.moveTo(px, py);
          else c.lineTo(px, py);
          last = px;
        });
        c.stroke();
      }
    };
    const points = ellipse(light, 2);
    outline([...points, points[0]]);
    const radius = (7 + 3 * light.share) * scale;
    c.beginPath();
    c.arc(x, y, radius, 0, 2 * Math.PI);
    c.fillStyle = "#ffd67a";
    c.fill();
    c.lineWidth = 2 * scale;
    c.strokeStyle = "#000";
    c.stroke();
    c.fillStyle = "#000";
    c.font = `700 ${1.25 * radius}px system-ui, sans-serif`;
    c.textAlign = "center";
    c.textBaseline = "middle";
    c.fillText(String(index + 1), x, y);
  }

  describe({ lights }) {
    const text = `Sphere of directions, ${lights.length} ${lights.length === 1 ? "light" : "lights"}` +
      (lights.length ? `; the strongest at azimuth ${degrees(anglesOf(lights[0].direction)[0])}, elevation ` +
        degrees(anglesOf(lights[0].direction)[1]) : "");
    if (this.canvas.getAttribute("aria-label") !== text) this.canvas.setAttribute("aria-label", text);
  }
}

/** Lights with the share of each in the irradiance of all, 0 to 1. */
export function withShares(lights) {
  const all = lights.reduce((sum, light) => sum + luminance(light.irradiance), 0);
  return lights.map((light) => ({ ...light, share: all > 0 ? luminance(light.irradiance) / all : 0 }));
}
