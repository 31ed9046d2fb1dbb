// Builds focus_planner/report/bundle from src/: the same bytes for the same sources and lock.
import { build } from "esbuild";
import { readFile, writeFile } from "node:fs/promises";

const into = process.argv[2] ?? "../focus_planner/report/bundle";
const { version } = JSON.parse(await readFile("node_modules/three/package.json", "utf8"));
const licence = (await readFile("node_modules/three/LICENSE", "utf8")).trim();

const program = await build({
  entryPoints: ["src/main.ts"],
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  charset: "ascii",
  legalComments: "none",
  write: false,
});
const style = await build({
  entryPoints: ["src/report.css"],
  bundle: true,
  minify: true,
  charset: "ascii",
  write: false,
});
const notice = `/*!\nBuilt by \`make bundle\` from report_page/. Contains three.js ${version}:\n\n${licence}\n*/\n`;
await writeFile(`${into}/report.js`, notice + program.outputFiles[0].text);
await writeFile(`${into}/report.css`, style.outputFiles[0].text);
