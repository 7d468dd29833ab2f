// Tables of lights, conditions, faults and the connection.
import { anglesOf, directionSigma } from "./directions.js";
import { degrees, element, make, put, putPairs, short, size, whole } from "./format.js";
import { luminance } from "./sdk/vector.js";

/** One row a light, as many as the descriptor has. */
export function putLights({ lights, units }) {
  const body = element("lights").tBodies[0];
  while (body.rows.length > lights.length) body.deleteRow(-1);
  lights.forEach((light, i) => {
    const row = body.rows[i] ?? body.appendChild(make("tr", {},
      make("th", { scope: "row" }, make("span", { className: "swatch" }, String(i + 1))),
      ...Array.from({ length: 6 }, () => make("td", { className: "num" }))));
    const [azimuth, elevation] = anglesOf(light.direction);
    const near = light.distance > 0 ? `${short(light.distance)} ± ${short(light.distanceSigma)} m` : "distant";
    [short(luminance(light.irradiance)), degrees(azimuth), degrees(elevation), degrees(2 * directionSigma(light)),
     degrees(light.angularRadius), near].forEach((text, k) => put(row.cells[k + 1], text));
  });
  put("irradiance-unit", units === "absolute" ? "Lux" : "Irradiance");
  element("no-lights").hidden = lights.length > 0;
  element("lights-region").hidden = lights.length === 0;
}

const conditions = {
  unseen: "part of the sphere was never seen; its light is missing",
  clipped: "some pixels were saturated in every exposure; their energy is a lower bound",
  cleaned: "the input held invalid radiance, which was replaced",
  dark: "nothing but darkness: no relative error can be stated",
  moved: "something moved between the exposures of a bracket",
  filled: "directions that no pixel sees were filled in",
  recovered: "the energy of saturated pixels was recovered",
  unsure: "what was seen fits several lights, or too little was seen",
  newer: "a condition that this page does not know",
};
/** These do not make the answer worse. */
const harmless = new Set(["recovered"]);

export function putConditions({ flags, flicker, units, saturated }) {
  const lines = [...flags].map((flag) => [harmless.has(flag) ? "good" : "bad", flag, conditions[flag]]);
  if (!lines.some(([mark]) => mark === "bad"))
    lines.unshift(["good", "reliable", "the probe reports no fault of this estimate"]);
  if (flicker === "100 Hz" || flicker === "120 Hz") lines.push(["", "flicker", `the light flickers at ${flicker}`]);
  lines.push(["", "units", units === "absolute" ? "absolute, lux and cd/m²" : "relative, by one unknown factor"]);
  if (saturated > 0) lines.push(["", "saturated", `${short(100 * saturated)} % of what is seen`]);
  const list = element("conditions");
  const text = lines.map((line) => line.join(" ")).join("|");
  if (list.dataset.text === text) return;
  list.dataset.text = text;
  list.replaceChildren(...lines.map(([mark, name, what]) =>
    make("li", { className: mark }, make("b", {}, name), ` ${what}`)));
}

const faults = [
  ["Frames lost by the camera", "framesLost"],
  ["Captures dropped (a newer one came)", "capturesDropped"],
  ["Incomplete brackets", "bracketsIncomplete"],
  ["Estimates that failed", "estimatesFailed"],
  ["Estimates later than the budget", "estimatesLate"],
  ["Changes of setting by the budget", "settingMoves"],
  ["Descriptors that slow clients missed", "descriptorsCoalesced"],
  ["Faults of the frame recording", "recordingFaults"],
  ["Messages refused", "messagesRefused"],
  ["Failed authentications", "authenticationFailures"],
  ["Faults of the list of clients", "clientListFaults"],
];

export function putFaults(counters, history) {
  const body = element("faults").tBodies[0];
  faults.forEach(([label, name], i) => {
    const row = body.rows[i] ?? body.appendChild(make("tr", {}, make("th", { scope: "row" }, label),
      make("td", { className: "num" }), make("td", { className: "num" })));
    const risen = history.risen(name);
    put(row.cells[1], whole(counters[name]));
    put(row.cells[2], risen > 0 ? `+${whole(risen)}` : "0");
    row.cells[1].className = counters[name] > 0 ? "num" : "num zero";
    row.cells[2].className = risen > 0 ? "num raised" : "num zero";
  });
}

const linkNames = { grpc: "gRPC", web: "Browsers", usb_gadget: "USB", mqtt: "MQTT" };

/** One row for each link of the probe; a fault as a mark and a word. */
export function putLinks(links) {
  element("links").hidden = element("links-title").hidden = links.length === 0;
  const body = element("links").tBodies[0];
  while (body.rows.length > links.length) body.deleteRow(-1);
  links.forEach((link, i) => {
    const row = body.rows[i] ?? body.appendChild(make("tr", {}, make("th", { scope: "row" }, make("span")),
      ...Array.from({ length: 4 }, () => make("td", { className: "num" }))));
    const name = row.cells[0].firstChild;
    put(name, (linkNames[link.name] ?? link.name) + (link.fault ? " – fault, see the log" : ""));
    name.className = link.fault ? "raised" : "";
    [link.clients, link.descriptorsCoalesced, link.messagesRefused, link.authenticationFailures].forEach((v, k) => {
      put(row.cells[k + 1], whole(v));
      row.cells[k + 1].className = v > 0 ? "num" : "num zero";
    });
  });
}

export function putLink(probe, info, stats) {
  const { counters } = info;
  putPairs(element("link-facts"), [
    ["Received", `${whole(stats.received)} descriptors, ${size(stats.bytes)}`],
    ["Missing captures", whole(stats.gaps)],
    ["Refused messages", whole(stats.undecodable + stats.oversized)],
    ["Repeated", whole(stats.replayed)],
    ["Reconnections", whole(stats.reconnects)],
    ["Maps for reflections", whole(stats.maps)],
    ["Clock of the probe",
     `± ${short(Number(info.clockUncertaintyNs) / 1e6)} ms, drift ${short(info.clockDriftPpm)} ppm`],
    ["Frames of the probe", `${whole(counters.frames)}, ${whole(counters.estimates)} estimates`],
    ["Clients of the probe", whole(counters.clients)],
    ...(info.temperatureC === null ? [] : [["Temperature of the probe", `${info.temperatureC.toFixed(1)} °C`]]),
    ["Last error", stats.lastError || "none"],
  ]);
}
