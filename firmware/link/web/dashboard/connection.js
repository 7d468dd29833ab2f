// From the address of this page to a connected probe: asks for a token where the link is encrypted.
import { element, put } from "./format.js";
import { ProbeError } from "./sdk/link_message.js";
import { connect } from "./sdk/probe.js";

const key = "lightwell token";
const retryMs = 1000;
export const address = location.origin.replace(/^http/, "ws");

/** In plain text the probe asks for none, and a token must not be sent. */
const encrypted = location.protocol === "https:";

/** null: no token is sent. */
export const storedToken = () =>
  encrypted ? sessionStorage.getItem(key) ?? localStorage.getItem(key) : null;

function forget() {
  sessionStorage.removeItem(key);
  localStorage.removeItem(key);
}

export function showState(state, text) {
  element("link-state").dataset.state = state;
  put("link-state-text", text);
}

/** Resolves with a token, empty for a client with a certificate. */
function askToken(error) {
  const form = element("sign-in-form");
  const input = element("token");
  element("sign-in").hidden = false;
  element("live").hidden = true;
  element("sign-in-error").hidden = !error;
  put("sign-in-error", error);
  showState("idle", "not connected");
  put("probe-name", "Lightwell");
  put("probe-detail", "a light probe");
  input.focus();
  return new Promise((resolve) => {
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      const token = input.value.trim();
      input.value = "";
      resolve({ token, remember: element("remember").checked });
    }, { once: true });
  });
}

function keep(token, remember) {
  forget();
  (remember ? localStorage : sessionStorage).setItem(key, token);
}

const pause = (ms) => new Promise((resume) => setTimeout(resume, ms));

/** Tries until it succeeds. The form appears when the probe needs a token, and stays until one is accepted. */
async function connected(error) {
  let token = encrypted ? storedToken() : "";
  let remember = null;
  for (;;) {
    if (token === null) ({ token, remember } = await askToken(error));
    showState("connecting", "connecting");
    try {
      // The first message always is the token, also an empty one: the probe then knows that this is no other client.
      const probe = await connect(address, encrypted ? { token } : {});
      if (remember !== null) keep(token, remember);
      element("sign-in").hidden = true;
      return probe;
    } catch (cause) {
      if (!(cause instanceof ProbeError)) throw cause;
      if (cause.code === "failed_precondition" && encrypted) {
        forget();
        error = cause.message;
        token = null;
        continue;
      }
      showState("waiting", "no connection");
      await pause(retryMs);
    }
  }
}

/** Calls attach() with each probe: the first one, and another after the probe has refused this client. */
export async function run(attach) {
  element("sign-out").hidden = !encrypted;
  element("sign-out").addEventListener("click", () => {
    forget();
    location.reload();
  });
  for (let error = "";;) {
    const probe = await connected(error);
    attach(probe);
    error = await new Promise((resolve) => probe.on("refused", ({ message }) => resolve(message)));
    probe.close();
    if (encrypted) forget();
  }
}
