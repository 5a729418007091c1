// node read_page.js PAGE RECEIVERS: decodes the page's volume with web/lib/volume.js and compares it at the
// receivers with what the program and the closed form say. Prints JSON.
'use strict';
const fs = require('fs');
const path = require('path');

const source = fs.readFileSync(path.join(__dirname, '../../web/lib/volume.js'), 'utf8')
  .replaceAll('\nexport ', '\n'); // as the page has it
const LampVolume = new Function(`${source}; return LampVolume;`)();
const page = fs.readFileSync(process.argv[2], 'utf8');
if (!page.includes(source)) throw new Error('the page holds another volume.js');
const stated = JSON.parse(page.match(/<script type="application\/json" id="lamp">\n(.*)\n<\/script>/)[1]);
const receivers = JSON.parse(fs.readFileSync(process.argv[3], 'utf8'));

LampVolume.decode(stated).then((volume) => {
  const result = { receivers: receivers.length, from_program: 0, brightest: 0, of_stated: 0 };
  for (const { p, n, exact, volume: program, brightest } of receivers) {
    const read = volume.illuminance(p, n);
    const unit = Math.max(Math.abs(exact), stated.floor_share * brightest);
    const most = (key, x) => { result[key] = Math.max(result[key], x); };
    most('from_program', Math.abs(read - program) / unit);
    most('brightest', Math.abs(volume.brightestAt(p[2]) / brightest - 1));
    most('of_stated', Math.abs(read - exact) / (unit * volume.statedErrorAt(p[2])));
  }
  console.log(JSON.stringify(result));
});
