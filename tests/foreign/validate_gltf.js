// Khronos's gltf-validator on a file: prints its report as JSON; exit status 1 where it finds an error.
//
//     NODE_PATH=.../node_modules node validate_gltf.js lamp.glb
"use strict";

const fs = require("fs");
const validator = require("gltf-validator");

validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[2]))).then((report) => {
  console.log(JSON.stringify(report.issues));
  process.exitCode = report.issues.numErrors > 0 ? 1 : 0;
});
