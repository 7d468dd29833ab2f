// The npm package of bindings/typescript, packed and installed without a registry. Environment: LIGHTWELL_NPM (npm),
// LIGHTWELL_TSC (tsc), LIGHTWELL_TYPESCRIPT (the folder of the package's source).
import { execFileSync } from "node:child_process";
import { cpSync, mkdirSync } from "node:fs";
import { delimiter, dirname, join } from "node:path";

const { LIGHTWELL_NPM: npm, LIGHTWELL_TSC: tsc, LIGHTWELL_TYPESCRIPT: source } = process.env;

/** Runs npm in `folder`. A registry that does not exist: whatever needs one fails. */
export function runNpm(folder, ...args) {
  return execFileSync(npm, args, {
    cwd: folder, encoding: "utf8", stdio: ["ignore", "pipe", "pipe"],
    env: {
      ...process.env, PATH: `${dirname(tsc)}${delimiter}${process.env.PATH}`, npm_config_registry: "http://127.0.0.1:1",
      npm_config_cache: join(folder, ".npm-cache"), npm_config_audit: "false", npm_config_fund: "false",
      npm_config_update_notifier: "false",
    },
  });
}

/** A copy of the source without what was built there, in which npm may write. */
export function copySource(folder) {
  cpSync(source, folder, { recursive: true, filter: (path) => !/[/\\](dist|node_modules)$|\.tgz$/.test(path) });
}

/** `npm pack` in a copy of the source: { tarball, files } */
export function pack(folder) {
  const copy = join(folder, "source");
  copySource(copy);
  // Before npm's answer are the lines of the script that compiles.
  const text = runNpm(copy, "pack", "--json");
  const [{ filename, files }] = Object.values(JSON.parse(text.slice(text.search(/^[[{]/m))));
  return { tarball: join(copy, filename), files: files.map(({ path }) => path) };
}

/** An empty folder in which `what`, a tarball or a folder, was installed. */
export function installInto(folder, what) {
  mkdirSync(folder);
  runNpm(folder, "install", "--offline", what);
  return folder;
}
