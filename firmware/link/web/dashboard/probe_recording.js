// The probe's own recording: its state, start and stop.
import { element, put, size, whole } from "./format.js";

const stateText = ({ running, file, descriptors, bytes, lost }) => (file === "" ? "" :
  `${running ? "● Recording" : "Recorded"} ${whole(descriptors)} descriptors, ${size(bytes)}, in ${file}` +
  (lost > 0 ? `; ${whole(lost)} messages are missing, the probe’s disk was too slow` : ""));

export class ProbeRecording {
  constructor() {
    this.button = element("probe-record");
    this.button.addEventListener("click", () => void this.toggle());
  }

  attach(probe) {
    this.probe = probe;
    this.fail("");
    this.show(probe.info().recording);
  }

  /** status: of ProbeInfo; null where the probe cannot record. */
  show(status) {
    this.running = status?.running ?? false;
    this.button.hidden = status === null;
    element("probe-record-none").hidden = status !== null;
    put(this.button, this.running ? "Stop on the probe" : "Start on the probe");
    put("probe-record-state", status === null ? "" : stateText(status));
    if (status?.endReason) this.fail(`The recording has ended: ${status.endReason}`);
    else if (this.running) this.fail("");
  }

  async toggle() {
    // It stays focused, which a disabled button does not.
    if (this.busy) return;
    this.busy = true;
    const stop = this.running;
    try {
      const status = await (stop ? this.probe.stopRecording() : this.probe.startRecording());
      this.fail("");
      this.show(status);
    } catch (error) {
      this.fail(`The recording was not ${stop ? "stopped" : "started"}: ${error.message}`);
    }
    this.busy = false;
  }

  fail(text) {
    element("probe-record-error").hidden = text === "";
    put("probe-record-error", text);
  }
}
