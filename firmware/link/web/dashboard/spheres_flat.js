// Spheres on a plain canvas, shaded pixel by pixel from the queries of the SDK: where there is no three.js or no WebGL.
import { toDisplay } from "./panorama.js";
import { capIrradiance, evaluateHarmonics } from "./sdk/lobes.js";

const edge = 112;
const matte = { albedo: [0.9, 0.9, 0.9], shine: 0 };
const satin = { albedo: [0.76, 0.37, 0.04], shine: 60 };

/** Normals of a sphere seen along -Z, and the directions that a mirror reflects to the viewer. */
const pixels = Array.from({ length: edge * edge }, (_, i) => {
  const x = (2 * ((i % edge) + 0.5)) / edge - 1;
  const y = 1 - (2 * (Math.floor(i / edge) + 0.5)) / edge;
  const square = x * x + y * y;
  if (square > 1) return null;
  const z = Math.sqrt(1 - square);
  // View direction (0, 0, -1) minus twice its part along the normal.
  return { normal: [x, y, z], mirrored: [2 * z * x, 2 * z * y, 2 * z * z - 1], rim: Math.min(1, (1 - square) * 24) };
});

export class FlatSpheres {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.parts = ["matte", "satin", "mirror"].map(() => {
      const part = document.createElement("canvas");
      part.width = part.height = edge;
      return { part, image: part.getContext("2d").createImageData(edge, edge) };
    });
  }

  draw(lighting, panorama, exposure) {
    const coefficients = lighting.irradianceCoefficients();
    const shades = [
      (pixel, out, at) => this.paintIrradiance(lighting, coefficients, pixel, exposure, matte, out, at),
      (pixel, out, at) => this.paintIrradiance(lighting, coefficients, pixel, exposure, satin, out, at),
      ({ mirrored }, out, at) => this.paintMirror(lighting, panorama, mirrored, out, at),
    ];
    this.parts.forEach(({ part, image }, k) => {
      pixels.forEach((pixel, i) => {
        if (!pixel) return;
        shades[k](pixel, image.data, 4 * i);
        image.data[4 * i + 3] = 255 * pixel.rim;
      });
      part.getContext("2d").putImageData(image, 0, 0);
    });
    this.compose();
  }

  /** Lambert's reflection, and for `shine` above 0 the lights' Phong highlights. */
  paintIrradiance(lighting, coefficients, { normal, mirrored }, exposure, { albedo, shine }, out, at) {
    const sum = evaluateHarmonics(coefficients, normal);
    let gloss = 0;
    for (const light of lighting.lights) {
      const d = light.direction;
      const cosine = d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2];
      const k = capIrradiance(cosine, light.angularRadius);
      for (let c = 0; c < 3; ++c) sum[c] += k * light.irradiance[c];
      if (shine > 0) {
        const r = Math.max(0, d[0] * mirrored[0] + d[1] * mirrored[1] + d[2] * mirrored[2]);
        gloss += 0.04 * Math.max(...light.irradiance) * ((shine + 2) / (2 * Math.PI)) * r ** shine;
      }
    }
    for (let c = 0; c < 3; ++c)
      out[at + c] = toDisplay(exposure * ((albedo[c] / Math.PI) * Math.max(0, sum[c]) + gloss));
  }

  paintMirror(lighting, panorama, d, out, at) {
    const hit = lighting.lights.some(({ direction: [x, y, z], angularRadius }) =>
      x * d[0] + y * d[1] + z * d[2] >= Math.cos(Math.max(angularRadius, 0.05)));
    if (hit) out[at] = out[at + 1] = out[at + 2] = 255;
    else panorama.sample(Math.atan2(d[0], -d[2]) / (2 * Math.PI) + 0.5, 0.5 - Math.asin(d[1]) / Math.PI, out, at);
  }

  compose() {
    const { canvas, context: c } = this;
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const w = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const h = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== w || canvas.height !== h) Object.assign(canvas, { width: w, height: h });
    c.clearRect(0, 0, w, h);
    c.imageSmoothingQuality = "high";
    const side = Math.min(0.29 * w, 0.8 * h);
    this.parts.forEach(({ part }, k) =>
      c.drawImage(part, (w * (2 * k + 1)) / 6 - side / 2, (h - side) / 2, side, side));
  }
}
