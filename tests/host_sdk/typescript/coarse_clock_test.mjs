// The clock map on a platform whose performance.now() is rounded, as in browsers.
// usage: as connection_test.mjs; a file of its own, because the module measures the rounding once
import assert from "node:assert/strict";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

import { FakeProbe, WebSocket, until } from "./fake_probe.mjs";

const exact = performance.now.bind(performance);
const stepMs = 2;
performance.now = () => Math.floor(exact() / stepMs) * stepMs;

const { connect } = await import(pathToFileURL(process.env.LIGHTWELL_MODULE).href);

test("the uncertainty of the clock contains the rounding of the host's clock", async () => {
  const server = await FakeProbe.start();
  server.clockNow = () => BigInt(Math.round(exact() * 1e6)) + server.clockOffsetNs;
  const probe = await connect(server.address, { WebSocket });
  let infos = 0;
  probe.on("info", ({ clockOffsetNs, clockUncertaintyNs }) => {
    ++infos;
    const error = clockOffsetNs - server.clockOffsetNs;
    assert.ok(error <= clockUncertaintyNs && -error <= clockUncertaintyNs, `${error}, ${clockUncertaintyNs}`);
  });
  await until(() => infos >= 8, "eight round trips");
  probe.close();
  await server.stop();
});
