// The estimator's settings as a form, and the effect of the last change.
import { element, make, percent, put, short } from "./format.js";
import { settingsOf } from "./sdk/estimator_config.js";

const edges = [[0, "none"], [8, "8"], [16, "16"], [32, "32"], [64, "64"]];

/** Options as in config.proto, with what each costs. */
const fields = [
  { name: "maxLights", label: "Most lights", help: "Each costs about 30 bytes.", min: 0, max: 64, step: 1 },
  {
    name: "band", label: "Highest band", help: "Of the harmonics; higher is sharper and longer.",
    min: 0, max: 6, step: 1,
  },
  {
    section: "panorama", name: "epsilon", label: "Error limit",
    help: "Share of the irradiance; 0.01 is 1 %. Larger: fewer bytes.",
    min: 0, max: 0.99, step: "any",
  },
  {
    section: "panorama", name: "radianceEpsilon", label: "Error limit of reflections",
    help: "0: none. Smaller: more bytes.",
    min: 0, max: 0.99, step: "any",
  },
  {
    section: "panorama", name: "lightThreshold", label: "Light threshold",
    help: "Peak of a light, times the mean luminance.",
    min: 1.5, step: "any",
  },
  {
    section: "panorama", name: "smoothing", label: "Smoothing",
    help: "Steadies still light; changes are followed.",
    options: [["none", "none"], ["one_euro", "one euro filter"]],
  },
  {
    section: "panorama", name: "unseenFill", label: "Unseen directions", help: "What stands in for them.",
    options: [["none", "dark"], ["mirror", "mirrored light"], ["average", "mean of earlier light"]],
  },
  {
    section: "panorama", name: "environmentEdge", label: "Map for reflections",
    help: "Texels along an edge; kilobytes each.",
    options: edges,
  },
  { section: "panorama", name: "environmentRate", label: "Maps a second", help: "At most.", min: 0.1, step: "any" },
  {
    section: "panorama", name: "interleave", label: "Frames that read the picture once",
    help: "1: every frame is read whole. More: faster.",
    min: 1, max: 16, step: 1,
  },
  {
    section: "panorama", name: "maxBytes", label: "Longest message, bytes",
    help: "0: no limit. From 96; without maps. Shorter: larger error.",
    min: 0, step: 1,
  },
  {
    section: "marker", name: "decimation", label: "Decimation where expected",
    help: "0: by the tags' size. Larger: faster, less exact.",
    min: 0, max: 8, step: "any",
  },
  {
    section: "marker", name: "searchDecimation", label: "Decimation of the search",
    help: "1 to 8. Larger: faster, misses small tags.",
    min: 1, max: 8, step: "any",
  },
  { section: "marker", name: "maxFaces", label: "Most faces", help: "0: all that are seen.", min: 0, step: 1 },
  {
    section: "specular", name: "environmentEdge", label: "Map for reflections",
    help: "Texels along an edge; kilobytes each.",
    options: edges,
  },
];
const settingHelp = {
  fastest: "As fast, and a frame reads a sixteenth of the picture, in turn, and the lights.",
  fast: "Twice the error that the limits allow.",
  balanced: "The limits of the error as they are.",
  exact: "Nothing that was found is left out.",
};
const effects = [
  ["Estimate", "estimate", (v) => `${short(v)} ms`],
  ["Message", "bytes", (v) => `${short(v)} B`],
  ["Error bound", "bound", percent],
  ["Frame rate", "rate", (v) => `${short(v)} /s`],
  ["Lights", "lights", short],
];
/** Means hold nothing of before the change after this time. */
const settledMs = 2500;

export class SettingsView {
  /** summary: the present means of Measures. */
  constructor(summary) {
    this.summary = summary;
    this.form = element("settings");
    this.inputs = new Map();
    this.form.addEventListener("submit", (event) => event.preventDefault());
    this.form.addEventListener("change", ({ target }) => this.change(target));
    this.change = this.change.bind(this);
  }

  async attach(probe) {
    this.probe = probe;
    this.say("", false);
    element("effect").hidden = true;
    try {
      this.show(await probe.estimator());
    } catch (error) {
      this.say(`The settings are not known: ${error.message}`, true);
    }
  }

  say(text, failed) {
    put("settings-message", text);
    element("settings-message").className = failed ? "error" : "";
  }

  show(state) {
    if (this.kind !== state.kind) this.build(state.kind);
    this.state = state;
    const { config } = state;
    for (const input of this.form.querySelectorAll("input[name=setting]"))
      input.checked = input.value === config.setting;
    put(this.form.querySelector("fieldset small"), settingHelp[config.setting]);
    for (const [{ section, name }, input] of this.inputs) {
      const value = String(section ? config[section][name] : config[name]);
      if (document.activeElement !== input || input.value === "") input.value = value;
    }
  }

  build(kind) {
    this.kind = kind;
    this.inputs.clear();
    const choices = settingsOf(kind).map((setting) =>
      make("label", {}, make("input", { type: "radio", name: "setting", value: setting }), make("span", {}, setting)));
    const group = make("fieldset", {}, make("legend", {}, "Setting"), make("div", { className: "choices" }, ...choices),
                       make("small", { className: "muted" }));
    const rest = fields.filter(({ section }) => !section || section === kind).map((field) => {
      const id = `option-${field.section ?? "common"}-${field.name}`;
      const input = field.options ?
        make("select", { id },
             ...field.options.map(([value, text]) => make("option", { value: String(value) }, text))) :
        make("input", { id, type: "number", min: field.min, max: field.max ?? "", step: field.step, required: true });
      input.setAttribute("aria-describedby", `${id}-help`);
      this.inputs.set(field, input);
      return make("div", { className: "field" }, make("label", { htmlFor: id }, field.label), input,
                  make("small", { id: `${id}-help` }, field.help));
    });
    this.form.replaceChildren(group, ...rest);
  }

  async change(input) {
    if (input.name !== "setting" && !input.reportValidity()) return;
    const [field] = [...this.inputs].find(([, i]) => i === input) ?? [{ name: "setting", options: [] }];
    const number = !field.options || field.options === edges;
    const value = number ? Number(input.value) : input.value;
    const update = field.section ? { [field.section]: { [field.name]: value } } : { [field.name]: value };
    const label = field.label ?? "Setting";
    const before = this.summary();
    this.say(`${label}: sending …`, false);
    try {
      const state = await this.probe.changeEstimator(update);
      this.show(state);
      this.before = { means: before, at: performance.now() };
      const now = input.selectedOptions ? input.selectedOptions[0].text : input.value;
      this.say(`${label} is now ${now}.`, false);
      put("effect-title", `Effect of “${label}”`);
      element("effect").hidden = false;
    } catch (error) {
      this.say(`${label} was not changed: ${error.message}`, true);
      if (this.state) this.show(this.state);
    }
  }

  /** Called a few times a second. */
  update(now) {
    if (!this.before || element("effect").hidden) return;
    const body = element("effect").querySelector("tbody");
    const after = this.summary();
    const settled = now > this.before.at + settledMs;
    effects.forEach(([label, name, text], i) => {
      const row = body.children[i] ?? body.appendChild(make("tr", {}, make("th", { scope: "row" }, label),
        ...[0, 1, 2].map(() => make("td", { className: "num" }))));
      const [a, b] = [this.before.means[name], after[name]];
      const change = a > 0 && Number.isFinite(b / a) ?
        `${b >= a ? "+" : "−"}${Math.abs(100 * (b / a - 1)).toFixed(0)} %` : "–";
      put(row.children[1], text(a));
      put(row.children[2], settled ? text(b) : "…");
      put(row.children[3], settled ? change : "…");
    });
  }
}
