// What the tiles show: means over the last two seconds, and their history of a minute.
import { luminance } from "./sdk/vector.js";

const windowMs = 2000;
const historyPeriodMs = 500;
const historyLength = 120;

const mean = (values) => (values.length ? values.reduce((sum, v) => sum + v, 0) / values.length : NaN);

function quantile(values, share) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted.length ? sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] : NaN;
}

/** What is kept of one descriptor; times in ms. */
function measured({ descriptor: d, bytes, midExposureNs, timeUncertaintyNs, receivedNs }) {
  const delivered = d.deliveredAfterUs / 1000;
  const encoded = d.encodedAfterUs / 1000;
  return {
    at: Number(receivedNs) / 1e6,
    exposed: Number(d.midExposureNs) / 1e6,
    latency: Number(receivedNs - midExposureNs) / 1e6,
    uncertainty: Number(timeUncertaintyNs) / 1e6,
    camera: delivered,
    estimate: Math.max(0, encoded - delivered),
    bytes: bytes.length,
    bound: d.bound.total,
    lights: d.lights.length,
    band: d.band,
  };
}

export class Measures {
  constructor() {
    this.recent = [];
    this.history = { rate: [], bound: [], bytes: [], lux: [] };
    this.historyAt = 0;
  }

  add(arrival) {
    const sample = measured(arrival);
    this.recent.push(sample);
    this.expire(sample.at);
  }

  expire(now) {
    let first = 0;
    while (first < this.recent.length && this.recent[first].at < now - windowMs) ++first;
    if (first > 0) this.recent.splice(0, first);
  }

  /** Means at `now` (performance.now()); NaN where nothing came. */
  summary(now) {
    this.expire(now);
    const { recent } = this;
    const of = (name) => mean(recent.map((sample) => sample[name]));
    // By the camera's times, which a busy page does not shift.
    const span = recent.length > 1 ? recent[recent.length - 1].exposed - recent[0].exposed : 0;
    const latency = of("latency");
    const encoded = of("camera") + of("estimate");
    return {
      rate: span > 0 ? (1000 * (recent.length - 1)) / span : recent.length ? NaN : 0,
      latency,
      latencyHigh: quantile(recent.map((sample) => sample.latency), 0.95),
      uncertainty: recent.length ? recent[recent.length - 1].uncertainty : NaN,
      camera: of("camera"),
      estimate: of("estimate"),
      network: Math.max(0, latency - encoded),
      bytes: of("bytes"),
      bound: of("bound"),
      lights: of("lights"),
      band: of("band"),
    };
  }

  /** Adds a point to the history every half second. */
  keepHistory(now, summary, lighting) {
    if (now < this.historyAt + historyPeriodMs) return false;
    this.historyAt = now;
    const values = { ...summary, lux: luminance(lighting.irradiance([0, 1, 0]).value) };
    for (const [name, list] of Object.entries(this.history)) {
      list.push(values[name]);
      if (list.length > historyLength) list.shift();
    }
    return true;
  }
}

/** By how much counters rose within the last minute. */
export class CounterHistory {
  constructor() {
    this.snapshots = [];
  }

  add(now, counters) {
    const last = this.snapshots[this.snapshots.length - 1];
    // A restarted probe counts from zero.
    if (last && counters.frames < last.counters.frames) this.snapshots = [];
    this.snapshots.push({ now, counters });
    while (this.snapshots.length > 1 && this.snapshots[1].now <= now - 60_000) this.snapshots.shift();
  }

  risen(name) {
    const { snapshots } = this;
    if (!snapshots.length) return 0;
    return snapshots[snapshots.length - 1].counters[name] - snapshots[0].counters[name];
  }
}
