// Records the descriptors that arrive, and saves them as a file.
import { duration, element, put, size } from "./format.js";
import { encodeRecord, recordingStart } from "./sdk/recording.js";

/** A minute at 60 descriptors a second with maps is some 20 MB; a tab has memory for this. */
const maxBytes = 128e6;

export class Recorder {
  constructor() {
    this.button = element("record");
    this.parts = null;
    this.button.addEventListener("click", () => (this.parts ? this.save() : this.start()));
  }

  attach(probe) {
    this.probe = probe;
    probe.on("descriptor", (arrival) => this.add(arrival));
  }

  start() {
    const info = this.probe?.info();
    if (!info) return;
    this.name = info.name;
    this.begin = performance.now();
    this.bytes = 0;
    this.count = 0;
    this.parts = [recordingStart(info.name, `dashboard ${info.version}`)];
    put(this.button, "Stop and save");
    this.report();
  }

  add({ bytes, receivedNs }) {
    if (!this.parts) return;
    const record = encodeRecord({ timeNs: receivedNs, bytes });
    this.parts.push(record);
    this.bytes += record.length;
    ++this.count;
    if (this.bytes > maxBytes) this.save();
  }

  report() {
    if (this.parts)
      put("record-state", `● Recording: ${duration(performance.now() - this.begin)}, ${this.count} descriptors, ` +
        size(this.bytes));
  }

  save() {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob(this.parts, { type: "application/octet-stream" }));
    const date = new Date().toISOString().slice(0, 19).replace(/:/g, "");
    link.download = `${this.name.replace(/[^\w-]+/g, "_")}-${date}.lwr`;
    link.click();
    // The browser reads the blob after the click.
    setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
    put("record-state", `Saved ${this.count} descriptors, ${size(this.bytes)}, as ${link.download}.`);
    this.parts = null;
    put(this.button, "Start recording");
  }
}
