import { connect } from "lightwell";

const probe = await connect(process.argv[2] ?? "ws://127.0.0.1:7443");
await new Promise((received) => probe.on("descriptor", received));
const { value, validity, errorBound } = probe.latest().irradiance([0, 1, 0]);
console.log(`${validity}: irradiance from above ${value.map((e) => e.toFixed(3))}, error at most ${errorBound}`);
for (const { direction, irradiance } of probe.latest().lights) console.log(`light ${direction}: ${irradiance}`);
probe.close();
