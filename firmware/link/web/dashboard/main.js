// The dashboard: one connection, three rhythms.
//   each descriptor     the table of lights, the measures
//   each frame drawn    spheres and directions, where something changed
//   four times a second numbers and tables
import { putCalibration } from "./calibration.js";
import { address, run, showState, storedToken } from "./connection.js";
import { DirectionsView, withShares } from "./directions.js";
import { MarkerView } from "./estimator_views.js";
import { duration, element, percent, put, short, size, spark } from "./format.js";
import { CounterHistory, Measures } from "./model.js";
import { Exposure, Panorama } from "./panorama.js";
import { Preview } from "./preview.js";
import { ProbeRecording } from "./probe_recording.js";
import { Recorder } from "./recorder.js";
import { luminance } from "./sdk/vector.js";
import { SettingsView } from "./settings.js";
import { makeSpheres } from "./spheres.js";
import { putConditions, putFaults, putLights, putLink, putLinks } from "./tables.js";

const textPeriodMs = 250;
const panoramaPeriodMs = 200;
/** Pictures take at most half of the time of a slow device. */
const drawPeriodMs = { min: 33, max: 500 };

const recorder = new Recorder();
const probeRecording = new ProbeRecording();
const preview = new Preview();
const exposure = new Exposure();
const panorama = new Panorama();
const directions = new DirectionsView(element("directions"));
let measures = new Measures();
const settings = new SettingsView(() => measures.summary(performance.now()));
let spheres = null;
let probe = null;
let counters = new CounterHistory();
let marker = new MarkerView();
let plane = null;
/** Counts the estimators that were shown. */
let shown = 0;

const times = { text: 0, panorama: 0, draw: 0, drawn: 0, period: drawPeriodMs.min };
let changed = false;
let newest = null;

function onDescriptor(arrival) {
  const { descriptor } = arrival;
  measures.add(arrival);
  if (settings.kind === "marker") marker.add(descriptor);
  putLights(descriptor);
  newest = descriptor;
  changed = true;
}

const stateTexts = {
  connecting: "connecting", connected: "live", waiting: "reconnecting", closed: "not connected",
};

function onState(state) {
  showState(state, stateTexts[state]);
}

async function attach(next) {
  probe = next;
  measures = new Measures();
  counters = new CounterHistory();
  marker = new MarkerView();
  newest = null;
  element("live").hidden = false;
  onState(probe.stats().state);
  probe.on("descriptor", onDescriptor);
  probe.on("state", (state) => {
    onState(state);
    // After a restart of the probe its settings are those of its file again.
    if (state !== "connected") return;
    void showEstimator();
    void showCalibration();
  });
  probe.on("refused", () => {
    plane?.close();
    preview.hide("");
  });
  probe.on("info", onInfo);
  onInfo(probe.info());
  recorder.attach(probe);
  probeRecording.attach(probe);
  void showEstimator();
  void showCalibration();
  spheres ??= await makeSpheres(element("spheres"));
  put("spheres-note", spheres.note);
}

/** Settings and views of the estimator that runs now. */
async function showEstimator() {
  const current = ++shown;
  await settings.attach(probe);
  putIdentity(probe.info());
  element("marker-view").hidden = settings.kind !== "marker";
  element("plane-view").hidden = settings.kind !== "specular";
  plane?.close();
  plane = null;
  if (settings.kind !== "specular") return;
  // A page of other estimators does without these modules.
  const { PlaneView } = await import("./plane_view.js");
  if (current === shown) plane = new PlaneView(address, storedToken());
}

async function showCalibration() {
  // Older firmware does not know the request.
  putCalibration(await probe.calibration().catch(() => null));
}

function putIdentity(info) {
  document.title = `${info.name} – Lightwell`;
  put("probe-name", info.name);
  put("probe-detail", [info.camera, settings.kind, `firmware ${info.version}`].filter(Boolean).join(" · "));
}

function onInfo(info) {
  putIdentity(info);
  counters.add(performance.now(), info.counters);
  putFaults(info.counters, counters);
  putLinks(info.links);
  probeRecording.show(info.recording);
}

const boundParts = ["truncation", "sampling", "noise", "quantization", "smoothing"];

function putBound({ bound }) {
  put("bound", Number.isFinite(bound.total) ? short(100 * bound.total) : "none");
  put("bound-unit", Number.isFinite(bound.total) ? "%" : "");
  const largest = boundParts.reduce((a, b) => (bound[b] > bound[a] ? b : a));
  put("bound-sub", Number.isFinite(bound.total) ? `of the irradiance; ${largest} ${percent(bound[largest])}` :
    "see the conditions below");
}

function putLatency(means) {
  const parts = [["camera", means.camera], ["estimate", means.estimate], ["to this page", means.network]];
  put("latency", short(means.latency));
  put("latency-sub", `± ${short(means.uncertainty)}; 95 % below ${short(means.latencyHigh)}`);
  put("latency-parts", parts.map(([name, ms]) => `${name} ${short(ms)}`).join(" · "));
  const stack = element("latency-stack");
  if (!stack.children.length) stack.append(...parts.map(() => document.createElement("i")));
  parts.forEach(([, ms], i) => (stack.children[i].style.flexGrow = Number.isFinite(ms) ? Math.max(ms, 0.01) : 0));
}

function putTiles(lighting, now) {
  const d = lighting.descriptor;
  const means = measures.summary(now);
  put("rate", short(means.rate));
  put("rate-sub", `descriptor ${d.sequence}`);
  putLatency(means);
  putBound(d);
  put("bytes", short(means.bytes));
  put("bytes-sub", `${size(Math.round(means.bytes * means.rate) || 0)}/s · band ${d.band} · ${d.lights.length} ` +
    (d.lights.length === 1 ? "light" : "lights"));
  put("setting", d.setting);
  put("setting-sub", `costs ${short(means.estimate)} ms and ${short(means.bytes)} bytes a frame`);
  const up = luminance(lighting.irradiance([0, 1, 0]).value);
  put("lux", short(up));
  put("lux-unit", d.units === "absolute" ? "lux" : "relative");
  put("lux-sub", "irradiance of a table");
  put("coverage", `coverage ${percent(d.coverage)}`);
  if (measures.keepHistory(now, means, lighting))
    for (const [name, values] of Object.entries(measures.history))
      if (values.length > 1) spark(`${name}-spark`, values);
}

function putText(now) {
  const stats = probe.stats();
  const lighting = probe.latest();
  putLink(probe, probe.info(), stats);
  recorder.report();
  settings.update(now);
  if (!lighting.descriptor) {
    notice("The probe has sent no descriptor yet.");
    return;
  }
  const late = lighting.validity !== "valid";
  const age = duration(lighting.ageMs);
  if (late && stats.state !== "connected")
    notice(`This is the light of ${age} ago: ${stats.lastError}`);
  // Without the marker in view a probe gives no descriptor; the marker's view says so.
  else if (late && settings.kind !== "marker")
    notice(`No descriptor for ${age}: the probe is connected, but its camera or estimator gives none.`);
  else notice("");
  if (stats.state === "connected") showState(late ? "stale" : "connected", late ? "no new light" : "live");
  putTiles(lighting, now);
  putConditions(lighting.descriptor);
  if (settings.kind === "marker") marker.update(lighting);
  plane?.update();
}

function notice(text) {
  element("notice").hidden = text === "";
  put("notice", text);
}

function drawPictures(now) {
  const lighting = probe.latest();
  const factor = exposure.factor(newest, now);
  if (now >= times.panorama + panoramaPeriodMs) {
    times.panorama = now;
    panorama.update(lighting, factor);
    directions.setPanorama(panorama);
  }
  spheres?.view.draw(lighting, panorama, factor);
  directions.draw({ ...newest, lights: withShares(newest.lights) });
}

function onFrame(now) {
  requestAnimationFrame(onFrame);
  // Without a width nothing is laid out: before the style sheet has come, and while the page asks for a token.
  if (!probe || element("directions").clientWidth < 64) return;
  if (times.drawn) {
    // From the start of drawing to the next frame: what WebGL does after the calls have returned is in it.
    const cost = performance.now() - times.draw;
    times.period = Math.min(drawPeriodMs.max, Math.max(drawPeriodMs.min, 0.7 * times.period + 0.3 * 2 * cost));
    times.drawn = 0;
  }
  if (changed && now >= times.draw + times.period) {
    times.draw = times.drawn = now;
    changed = false;
    drawPictures(now);
  }
  if (now >= times.text + textPeriodMs) {
    times.text = now;
    putText(now);
  }
}

window.addEventListener("resize", () => (changed = newest !== null));
requestAnimationFrame(onFrame);
run((next) => void attach(next));
