// What the probe's calibration covers, and how well.
import { element, putPairs, short, whole } from "./format.js";

const models = {
  kannala_brandt: "Kannala-Brandt", double_sphere: "double sphere", mei: "Mei", equirectangular: "equirectangular",
};
const date = (timeS) => new Date(1000 * timeS).toISOString().slice(0, 10);

const lensText = ({ width, height, model, maxAngleDeg, response, vignetting, noise }) =>
  `${width} × ${height}, ${models[model] ?? model} up to ${short(maxAngleDeg)}°; response ${response}, ` +
  `vignetting ${vignetting ? "corrected" : "not corrected"}, noise ${noise ? "known" : "not known"}`;

/** Rows of the report. */
function reportPairs(report, lens) {
  if (!report) return [["Report", "none in the file"]];
  const geometry = report.geometryTimeS > 0 ?
    `${date(report.geometryTimeS)}: ${short(report.rmsPx)} px RMS over ${whole(report.points)} points` : "not reported";
  return [
    ["Geometry", geometry],
    ...report.seenDeg.map((seen, k) => [`${lens(k)}, boards`,
      `seen up to ${short(seen)}°, directions ± ${short(report.direction3SigmaDeg[k] ?? NaN)}° (3 σ)`]),
    ["Photometry", report.photometryTimeS > 0 ? date(report.photometryTimeS) : "not reported"],
  ];
}

/** null: the probe does not report it. */
export function putCalibration(calibration) {
  element("calibration").hidden = calibration === null;
  if (calibration === null) return;
  const { file, id, absolute, lenses, report } = calibration;
  const lens = (k) => (lenses.length > 1 ? `Lens ${k + 1}` : "Lens");
  putPairs(element("calibration-facts"), [
    ["File", file || "the camera’s own"],
    ["Identity", id.toString(16).padStart(8, "0")],
    ["Units", absolute ? "absolute, lux and cd/m²" : "relative; no luminance was measured"],
    ...lenses.map((summary, k) => [lens(k), lensText(summary)]),
    ...reportPairs(report, lens),
  ]);
}
