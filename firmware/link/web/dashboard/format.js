// Numbers as text, and elements that hold it.

export const element = (id) => document.getElementById(id);

/** Sets text only where it changed, so that nothing is laid out again without need. */
export function put(target, text) {
  const node = typeof target === "string" ? element(target) : target;
  if (node.textContent !== text) node.textContent = text;
}

export function make(tag, properties = {}, ...children) {
  const node = Object.assign(document.createElement(tag), properties);
  node.append(...children);
  return node;
}

/** Three significant digits, without an exponent where it fits. */
export function short(v) {
  if (!Number.isFinite(v)) return v === Infinity ? "∞" : "–";
  const size = Math.abs(v);
  if (size === 0) return "0";
  if (size >= 1e6 || size < 1e-3) return v.toExponential(1).replace("e+", "e");
  if (size >= 1000) return v.toLocaleString("en", { maximumFractionDigits: 0 });
  return v.toFixed(size >= 100 ? 0 : size >= 10 ? 1 : 2);
}

export const whole = (v) => Number(v).toLocaleString("en");
export const percent = (v) => (Number.isFinite(v) ? `${short(100 * v)} %` : "no bound");
export const degrees = (rad) => `${(rad * 180 / Math.PI).toFixed(1)}°`;

export function size(bytes) {
  if (bytes < 1000) return `${bytes} B`;
  return bytes < 1e6 ? `${(bytes / 1e3).toFixed(1)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
}

export function duration(ms) {
  if (ms < 1000) return `${Math.round(ms)} ms`;
  if (ms < 60_000) return `${(ms / 1000).toFixed(1)} s`;
  return `${Math.floor(ms / 60_000)} min ${Math.round(ms / 1000) % 60} s`;
}

/** Rows of term and value of a <dl>. */
export function putPairs(list, pairs) {
  const flat = pairs.flat();
  if (list.children.length !== flat.length)
    list.replaceChildren(...flat.map((_, i) => make(i % 2 === 0 ? "dt" : "dd")));
  flat.forEach((text, i) => put(list.children[i], text));
}

const svg = "http://www.w3.org/2000/svg";

/** A line of the values from 0 to their largest; null leaves a gap to the left. */
export function spark(target, values) {
  const node = element(target);
  let line = node.querySelector("polyline");
  if (!line) {
    const picture = document.createElementNS(svg, "svg");
    picture.setAttribute("viewBox", "0 0 100 28");
    picture.setAttribute("preserveAspectRatio", "none");
    picture.setAttribute("aria-hidden", "true");
    line = document.createElementNS(svg, "polyline");
    picture.append(line);
    node.append(picture);
  }
  const most = Math.max(...values.filter(Number.isFinite), 1e-30);
  const points = values.map((v, i) => [100 * i / (values.length - 1), Number.isFinite(v) ? 27 - 26 * v / most : null]);
  line.setAttribute("points", points.filter(([, y]) => y !== null).map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`)
    .join(" "));
}
