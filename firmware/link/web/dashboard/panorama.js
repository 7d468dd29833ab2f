// A small picture of all directions, for the map of directions and for the mirror sphere.
//   Exposure       how bright pictures are, adapted slowly
//   Panorama       radiance on an equirectangular grid, and as bytes of a display
import { luminance } from "./sdk/vector.js";

export const columns = 64;
export const rows = 32;

/** Unit vector of a pixel centre; the centre of the picture is -Z, to the right is +X. */
export function directionAt(u, v) {
  const phi = 2 * Math.PI * (u - 0.5);
  const theta = Math.PI * (0.5 - v);
  return [Math.cos(theta) * Math.sin(phi), Math.sin(theta), -Math.cos(theta) * Math.cos(phi)];
}

const directions = Array.from({ length: columns * rows }, (_, i) =>
  directionAt(((i % columns) + 0.5) / columns, (Math.floor(i / columns) + 0.5) / rows));

/** Mean radiance over the sphere, all light together (luminance). */
function meanRadiance({ radiance, lights }) {
  const ambient = luminance(radiance[0]) * Math.sqrt(0.25 / Math.PI);
  return Math.max(0, ambient + lights.reduce((sum, light) => sum + luminance(light.irradiance), 0) / (4 * Math.PI));
}

export class Exposure {
  constructor() {
    this.log = null;
    this.at = 0;
  }

  /** Factor that maps mean radiance to 0.35; follows changes within a second, so that a lamp's switching is seen. */
  factor(descriptor, now) {
    const mean = meanRadiance(descriptor);
    if (mean > 0) {
      const target = Math.log(0.35 / mean);
      const share = this.log === null ? 1 : 1 - Math.exp(-(now - this.at) / 1500);
      this.log = (this.log ?? 0) + share * (target - (this.log ?? 0));
      this.at = now;
    }
    return Math.exp(this.log ?? 0);
  }
}

/** Linear to a display's 0 to 255: a shoulder above 0.6 in place of a hard limit, then sRGB. */
export function toDisplay(linear) {
  const x = Math.max(0, linear);
  const y = x < 0.6 ? x : 0.6 + 0.4 * (1 - Math.exp(-(x - 0.6) / 0.4));
  return 255 * (y <= 0.0031308 ? 12.92 * y : 1.055 * y ** (1 / 2.4) - 0.055);
}

export class Panorama {
  constructor() {
    this.canvas = document.createElement("canvas");
    this.canvas.width = columns;
    this.canvas.height = rows;
    this.context = this.canvas.getContext("2d");
    this.image = this.context.createImageData(columns, rows);
    /** Of the present content. */
    this.version = 0;
  }

  /** Radiance without the lights, times `exposure`. Costs milliseconds: 2,048 queries. */
  update(lighting, exposure) {
    const { data } = this.image;
    directions.forEach((d, i) => {
      const { value } = lighting.radiance(d, 0);
      for (let k = 0; k < 3; ++k) data[4 * i + k] = toDisplay(exposure * value[k]);
      data[4 * i + 3] = 255;
    });
    this.context.putImageData(this.image, 0, 0);
    ++this.version;
  }

  /** Colour of a display at fractions u, v of the picture, interpolated; written to out at `at`. */
  sample(u, v, out, at) {
    const { data } = this.image;
    const x = u * columns - 0.5;
    const y = Math.min(Math.max(v * rows - 0.5, 0), rows - 1.001);
    const i = Math.floor(x);
    const j = Math.floor(y);
    const fx = x - i;
    const fy = y - j;
    const left = (i + columns) % columns;
    const right = (i + 1) % columns;
    for (let k = 0; k < 3; ++k) {
      const a = data[4 * (j * columns + left) + k] * (1 - fx) + data[4 * (j * columns + right) + k] * fx;
      const b = data[4 * ((j + 1) * columns + left) + k] * (1 - fx) + data[4 * ((j + 1) * columns + right) + k] * fx;
      out[at + k] = a * (1 - fy) + b * fy;
    }
  }
}

