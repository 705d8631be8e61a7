// Bundles src/ into dist/page.html: one file, into which page.cpp writes a report.
//
//   npm ci --ignore-scripts && npm run build
//   npm run check          fails when dist/page.html is not what the sources make
//
// The header of dist/page.html carries a hash of everything it is made from; a test compares it
// where there is no node.
import { createHash } from "node:crypto";
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const read = (path) => readFileSync(join(here, path), "utf8");

// SHA-256 over "path\0text\0" of every source, in order of their names.
const sources = [...readdirSync(join(here, "src")).sort().map((name) => `src/${name}`),
    "build.mjs", "package-lock.json", "package.json"];
const hash = createHash("sha256");
for (const path of sources) hash.update(`${path}\0${read(path)}\0`);

async function bundle(entry, loader) {
    const made = await build({
        entryPoints: [join(here, entry)], bundle: true, minify: true, write: false,
        format: "iife", target: ["chrome109", "firefox115", "safari17"], charset: "utf8",
        legalComments: "none", loader,
    });
    return made.outputFiles[0].text.trim();
}

// Without comments and blank lines; strings of GLSL keep their line ends, which #version needs.
const glsl = { ".vert": "text", ".frag": "text" };
const script = await bundle("src/main.js", glsl);
const style = await bundle("src/style.css", {});
const template = read("src/index.html").split("\n").map((line) => line.trim()).filter(Boolean)
    .join("\n");
const license = read("node_modules/uplot/LICENSE").trim();

const notice = `<!--
Made by tools/measure/report/page/build.mjs; do not edit. To make it again:
  cd tools/measure/report/page && npm ci --ignore-scripts && npm run build
sources ${hash.digest("hex")}

Contains uPlot ${JSON.parse(read("node_modules/uplot/package.json")).version}:
${license}
-->`;
// Functions as replacements: "$" in the script must stay as it is.
const page = template.replace("<!doctype html>", (text) => `${text}\n${notice}`)
    .replace("/*STYLE*/", () => style)
    .replace("/*SCRIPT*/", () => script.replaceAll("</script", "<\\/script")) + "\n";

const target = join(here, "dist/page.html");
if (process.argv.includes("--check")) {
    if (readFileSync(target, "utf8") !== page) {
        console.error("dist/page.html is not what the sources make: npm run build");
        process.exit(1);
    }
} else {
    writeFileSync(target, page);
    console.log(`dist/page.html: ${Buffer.byteLength(page)} bytes`);
}
