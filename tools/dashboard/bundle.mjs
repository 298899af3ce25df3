// Make page/vendor: three.js as one tree-shaken module, uPlot as it is published but minified, VENDORED.md, and the
// software bill of materials (SBOM) of the wheel.
//
// `npm run bundle` writes them; `npm run bundle -- --check` compares, and fails where they differ. The same
// package-lock.json gives the same bytes. Only maintainers need this: the page's files are committed.

import { createHash } from "node:crypto";
import { readFileSync, writeFileSync } from "node:fs";
import { basename, dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

import { build } from "esbuild";

const HERE = dirname(fileURLToPath(import.meta.url));
const MODULES = join(HERE, "node_modules");
const VENDOR = join(HERE, "../../src/bioscara/dashboard/page/vendor");

/** Shaders of materials that three_entry.js does not export: left empty, they are a tenth of the bundle. */
const UNUSED = /^(meshphysical|meshtoon|meshmatcap|lights_(physical|toon)_|transmission_|iridescence_|clearcoat_|envmap_physical_)/;

/** Shaders keep their line ends, which the preprocessor needs, and lose comments and indentation. */
const shorterShaders = {
  name: "shorter shaders",
  setup(/** @type {import("esbuild").PluginBuild} */ plugin) {
    plugin.onLoad({ filter: /\.glsl\.js$/ }, ({ path }) => ({
      contents: readFileSync(path, "utf8").replace(/`[^`]*`/g, UNUSED.test(basename(path)) ? "``" : shorter),
    }));
    // The package's entry is one file; its sources are the same, in modules.
    plugin.onResolve({ filter: /^three$/ }, () => ({ path: join(MODULES, "three/src/Three.js"), sideEffects: false }));
  },
};

/** @param {string} shader */
function shorter(shader) {
  return shader
    .replace(/\/\*.*?\*\//gs, "")
    .replace(/\/\/[^\n]*/g, "")
    .replace(/[ \t]+/g, " ")
    .replace(/ ?\n ?/g, "\n")
    .replace(/\n{2,}/g, "\n");
}

/**
 * Return a bundle with its licence on top.
 *
 * @param {string} name Package.
 * @param {string} entry File with the exports of the bundle.
 * @returns {Promise<string>} Its text.
 */
async function bundled(name, entry) {
  const { outputFiles } = await build({
    entryPoints: [entry],
    bundle: true,
    minify: true,
    format: "esm",
    target: "es2022",
    write: false,
    legalComments: "none",
    charset: "utf8",
    plugins: [shorterShaders],
  });
  return withLicence(name, outputFiles[0].text);
}

/**
 * @param {string} name
 * @param {string} text
 */
function withLicence(name, text) {
  const { version, license, homepage } = packageOf(name);
  return `/*! ${name} ${version} | ${license} licence, see VENDORED.md | ${homepage} */\n${text}`;
}

/** @param {string} name */
function packageOf(name) {
  return JSON.parse(readFileSync(join(MODULES, name, "package.json"), "utf8"));
}

/** @param {string} name */
function licenceOf(name) {
  return readFileSync(join(MODULES, name, "LICENSE"), "utf8").trim();
}

/** @param {Record<string, string>} files */
function listed(files) {
  const rows = Object.entries(files).map(([file, text]) => {
    const name = file.startsWith("three") ? "three" : "uplot";
    const hash = createHash("sha256").update(text).digest("hex");
    return `| \`${file}\` | ${name} ${packageOf(name).version} | ${packageOf(name).license} | \`${hash}\` |`;
  });
  const licences = ["three", "uplot"].map((name) =>
    `\n## Licence of ${name}\n\n${licenceOf(name).replace(/^/gm, "    ").replace(/ +$/gm, "")}\n`
  );
  return `# Libraries that the page carries

Made by \`npm run bundle\` in \`tools/dashboard\` from the packages of its \`package-lock.json\`; do not edit.

| file | package | licence | SHA-256 |
| --- | --- | --- | --- |
${rows.join("\n")}
${licences.join("")}`;
}

/**
 * Return the SBOM as CycloneDX: the packages that the wheel carries. Those that pip installs are in its metadata.
 *
 * @param {string[]} names Packages.
 */
function billOfMaterials(names) {
  const components = names.map((name) => {
    const { version, license, homepage } = packageOf(name);
    const purl = `pkg:npm/${name}@${version}`;
    return {
      type: "library",
      "bom-ref": purl,
      name,
      version,
      licenses: [{ license: { id: license } }],
      purl,
      externalReferences: [{ type: "website", url: homepage }],
    };
  });
  const subject = { type: "application", "bom-ref": "pkg:pypi/bioscara", name: "bioscara", purl: "pkg:pypi/bioscara" };
  const bill = {
    $schema: "http://cyclonedx.org/schema/bom-1.6.schema.json",
    bomFormat: "CycloneDX",
    specVersion: "1.6",
    version: 1,
    metadata: { component: subject },
    components,
    dependencies: [{ ref: subject["bom-ref"], dependsOn: components.map(({ purl }) => purl) }],
  };
  return `${JSON.stringify(bill, null, 2)}\n`;
}

const files = {
  "three.js": await bundled("three", join(HERE, "three_entry.js")),
  "uplot.css": withLicence("uplot", readFileSync(join(MODULES, "uplot/dist/uPlot.min.css"), "utf8")),
  "uplot.js": await bundled("uplot", join(MODULES, "uplot/dist/uPlot.esm.js")),
};
const all = {
  ...files,
  "VENDORED.md": listed(files),
  "bioscara.cdx.json": billOfMaterials(["three", "uplot"]),
  // Types for the modules of the page; the paths of tsconfig.json lead them to the packages.
  "three.d.ts": readFileSync(join(HERE, "three_entry.js"), "utf8"),
  "uplot.d.ts": 'export { default } from "uplot";\n',
};
if (process.argv.includes("--check")) {
  const stale = Object.entries(all).filter(([name, text]) => readFileSync(join(VENDOR, name), "utf8") !== text);
  for (const [name] of stale) console.error(`vendor/${name} differs: npm run bundle, in tools/dashboard`);
  process.exitCode = stale.length ? 1 : 0;
} else {
  for (const [name, text] of Object.entries(all)) writeFileSync(join(VENDOR, name), text);
}
