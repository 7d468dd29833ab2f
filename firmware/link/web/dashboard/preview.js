// The camera's preview: a small picture each second while it is asked for and the page is visible.
import { storedToken } from "./connection.js";
import { element, put } from "./format.js";

const periodMs = 1000;

export class Preview {
  constructor() {
    this.button = element("preview-toggle");
    this.picture = element("preview-picture");
    this.button.addEventListener("click", () => (this.shown ? this.hide("") : this.show()));
  }

  show() {
    this.shown = true;
    put(this.button, "Hide the picture");
    put("preview-message", "waiting for a picture");
    void this.run();
  }

  hide(error) {
    this.shown = false;
    put(this.button, "Show the picture");
    put("preview-message", "");
    element("preview-error").hidden = error === "";
    put("preview-error", error);
    this.picture.hidden = true;
    this.picture.removeAttribute("src");
    URL.revokeObjectURL(this.url);
    this.url = undefined;
  }

  async run() {
    // Only one run at a time: a second click may come while the first run waits.
    if (this.running) return;
    this.running = true;
    while (this.shown) {
      const start = performance.now();
      if (!document.hidden) await this.fetch();
      await new Promise((resume) => setTimeout(resume, Math.max(50, start + periodMs - performance.now())));
    }
    this.running = false;
  }

  async fetch() {
    try {
      const token = storedToken();
      const response = await fetch("v1/preview.jpg", token ? { headers: { authorization: `Bearer ${token}` } } : {});
      if (!this.shown) return;
      // A refusal is final until the user asks again; 429 and 503 are not.
      if (response.status === 403 || response.status === 401) return this.hide(await response.text());
      if (!response.ok) return put("preview-message", await response.text());
      const url = URL.createObjectURL(await response.blob());
      if (!this.shown) return URL.revokeObjectURL(url);
      URL.revokeObjectURL(this.url);
      this.url = this.picture.src = url;
      this.picture.hidden = false;
      element("preview-error").hidden = true;
      put("preview-message", "");
    } catch {
      if (this.shown) put("preview-message", "no connection: this picture is old");
    }
  }
}
