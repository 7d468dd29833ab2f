// The picture of the dashboard in firmware/link/web/dashboard/README.md. Needs the panoramas (cmake/fetch_panoramas).
// usage: cmake --build build/dev --target dashboard_picture; environment: that of dashboard_test.mjs
import { Browser } from "./browser.mjs";
import { Daemon } from "./daemon.mjs";

const [file] = process.argv.slice(2);
const daemon = await Daemon.start({ camera: "sim:interior", size: "640x480", more: ["--name", "living room"] });
const browser = await Browser.start();
try {
  const page = await browser.newPage();
  await page.view(1280, 772, { scale: 1 });
  await page.goto(daemon.page);
  await page.until('document.querySelector("#rate-spark polyline")?.getAttribute("points").split(" ").length > 30');
  await page.picture(file);
} finally {
  await browser.stop();
  await daemon.stop();
}
