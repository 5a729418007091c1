// Reads a lamp file as a page does: read_lamp.mjs LIBRARY FILE. Exit code 2 with one sentence where the
// reader refuses it in its own words, 1 for anything else that it throws.

import { readFileSync, statSync } from 'node:fs';

const [, , library, file] = process.argv;
const { volumesOfGlb } = await import(library);
if (!statSync(file, { throwIfNoEntry: false })?.isFile()) {
  console.error(`luxfield: ${file} is no file`); // a page is given bytes; a pipe would wait for ever
  process.exit(2);
}
try {
  for (const lamp of await volumesOfGlb(readFileSync(file)))
    for (const p of [[0, 0, 0.001], [0.1, 0, 2], [40, 3, 4000]])
      lamp.uncertainty(p, [0, 0, -1]), lamp.farFieldLightVector(p);
} catch (problem) {
  const own = problem.constructor === Error && /glTF|LUXFIELD_light_field/.test(problem.message);
  console.error(own || problem.code ? `luxfield: ${problem.message}` : problem.stack);
  process.exitCode = own || problem.code ? 2 : 1;
}
