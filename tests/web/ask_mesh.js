// A cube and a ball as .obj files in the places of the room's box and sphere, which tests reach by
// window.testBox and window.testSphere: their readings, their picture, what is refused, and extremes.
// ONLY_MESH: of a page whose box is out of sight; it draws the cube alone.
const errors = [];
window.addEventListener('error', (event) => errors.push(event.message));
window.addEventListener('unhandledrejection', (event) => errors.push(String(event.reason)));

const CUBE = ['0 0 0', '5 0 0', '5 5 0', '0 5 0', '0 0 4', '5 0 4', '5 5 4', '0 5 4']
  .map((v) => `v ${v.split(' ').map((x) => 7 + 0.1 * x).join(' ')}`)
  .concat('f 1 4 3 2', 'f 5 6 7 8', 'f -8 -7 -3 -4', 'f 3 4 8 7', 'f 1/1/ 5/2 8/3 4', 'f 2 3 \\\r\n 7 6')
  .join('\r\n');

// A ball of radius 0.3 by latitudes and longitudes, with the normals of the sphere.
function ball(latitudes, longitudes) {
  const rows = [], faces = [];
  for (let j = 0; j <= latitudes; ++j)
    for (let i = 0; i < longitudes; ++i) {
      const a = Math.PI * j / latitudes, b = 2 * Math.PI * i / longitudes;
      const n = [Math.sin(a) * Math.cos(b), Math.cos(a), Math.sin(a) * Math.sin(b)];
      rows.push(`v ${n.map((x) => 0.3 * x).join(' ')}`, `vn ${n.join(' ')}`);
      if (j === 0) continue;
      const corner = (row, k) => longitudes * row + k % longitudes + 1;
      const four = [corner(j - 1, i), corner(j - 1, i + 1), corner(j, i + 1), corner(j, i)];
      faces.push(`f ${four.map((k) => `${k}//${k}`).join(' ')}`);
    }
  return rows.concat(faces).join('\n');
}

function setLamp(values) {
  for (const [name, value] of Object.entries(values)) {
    const input = document.getElementById(name);
    input.value = value;
    input.dispatchEvent(new Event('input'));
  }
}

// Readings along rays from before the room to places about a target.
function readings(target, reach) {
  const eye = [1.3, 1.2, 0.4], list = [];
  for (let j = 0; j < 24; ++j)
    for (let i = 0; i < 24; ++i) {
      const to = [(i - 11.6) / 12, (j - 11.7) / 12, 0].map((x, k) => target[k] + reach * x - eye[k]);
      list.push(window.luxfield.readingAlong(eye, to) || { name: 'nothing', illuminance: 0 });
    }
  return list;
}

// The largest deviation in shares of the brightest, on the object and about it, and how many are off.
function compare(expected, found, name) {
  const most = Math.max(...expected.map((one) => one.illuminance));
  const result = { on_it: 0, lit_on_it: 0, shadowed: 0, worst: 0, off: 0, other_surface: 0 };
  expected.forEach((one, k) => {
    const other = found[k], mine = one.name === name;
    if (other.name !== (mine ? 'mesh' : one.name)) { ++result.other_surface; return; }
    const away = Math.abs(one.illuminance - other.illuminance) / most;
    result.on_it += mine;
    result.lit_on_it += mine && one.illuminance > 0.02 * most;
    result.shadowed += !mine && one.shadowed === true;
    result.off += away > 0.01;
    if (one.estimate === other.estimate && one.shadowed === other.shadowed)
      result.worst = Math.max(result.worst, away);
  });
  return result;
}

function pixels(width = 160, height = 120) {
  window.luxfield.frameTime(width, height, 1);
  const copy = Object.assign(document.createElement('canvas'), { width, height }).getContext('2d');
  copy.drawImage(document.getElementById('view'), 0, 0);
  const { data } = copy.getImageData(0, 0, width, height);
  return Array.from(data.filter((x, k) => k % 4 !== 3));
}

function refused(text) {
  try {
    window.luxfield.addMesh(text, 'bad.obj');
    return 'taken';
  } catch (problem) {
    return problem.message;
  }
}

const triangles = (count) => `v 0 0 0\nv 1 0 0\nv 0 1 0\n${'f 1 2 3\n'.repeat(count)}`;

function extremes(result) {
  const add = (text, options) => window.luxfield.addMesh(text, 'it.obj', options);
  const sheet = (side) => `v 0 0 0\nv ${side} 0 0\nv ${side} 0 ${side}\nv 0 0 ${side}\nf 1 2 3 4`;
  result.flat = add(sheet(3)).size;
  result.tiny = add(CUBE.replace(/v .*/g, (row) => row.replace(/\S+$|\d\S*/g, (x) => 1e-3 * x))).size;
  result.upright = add(sheet(1), { zUp: true }).size;
  result.most = add(triangles(50000)).triangles;
  add(CUBE, { at: [0.45, 0] });  // about the lamp, and before it
  result.tones = [];
  for (const values of [{ height: 100 }, { height: 173, pitch: 0 }, { yaw: 1000 }, { distance: 0 }]) {
    setLamp(values);
    result.tones.push(new Set(pixels(40, 30)).size);
  }
}

// A file dropped on the picture: what the page says of it, '' where it takes it. It is read at once: time is
// the browser's own here, and does not wait for disks.
async function drop(text, name) {
  const dataTransfer = new DataTransfer(), message = document.getElementById('message');
  dataTransfer.items.add(new File([text], name));
  File.prototype.text = async () => text;
  document.getElementById('view').dispatchEvent(new DragEvent('drop', { dataTransfer, bubbles: true }));
  await new Promise((resolve) => setTimeout(resolve, 200));
  return message.hidden ? '' : message.textContent;
}

window.luxfield.ready.then(async () => {
  const result = {}, { addMesh, removeMesh } = window.luxfield;
  setLamp({ side: 590, height: 173, pitch: 460 });
  document.querySelector('input[name="mode"][value="1"]').click();
  if (ONLY_MESH) {
    result.without = pixels();
    addMesh(CUBE, 'cube.obj', { at: [0.6, -1.5] });
    result.pixels = pixels();
    removeMesh();
    result.again = JSON.stringify(pixels()) === JSON.stringify(result.without);
  } else {
    result.pixels = pixels();
    for (const [name, shape, text] of [['box', window.testBox, CUBE], ['sphere', window.testSphere, ball(48, 96)]]) {
      const [x, y, z] = shape.centre;
      if (name === 'sphere') setLamp({ side: 400, height: 120, pitch: 480 });
      const expected = readings([x, y, z], 0.9);
      shape.centre[1] = -50;
      result[name] = addMesh(text, name, { at: [x, z] });
      result[name].compared = compare(expected, readings([x, y, z], 0.9), name);
      shape.centre[1] = y;
      removeMesh();
    }
    result.refused = ['', 'solid x\nfacet', triangles(50001), 'v 0 0 nan\nf 1 1 1', 'v 0 0\n', 'v 0 0 0\nf 1 1 2',
      'v 0 0 0\nf 1 1 0', 'v 0 0 0\nf 1 1', 'v 1 1 1\nf 1 1 1', 'v 0 0 0\nv 1 0 0\nf 1 2 1',
      'v 0 0 0\nvn 1 0 inf\nf 1 1 1', 'v 0 0 0\nf 1//1 1 1', 'v 1e300 0 0\nv -1e300 0 0\nv 0 1 0\nf 1 2 3',
      ' '.repeat(20000001)].map(refused);
    extremes(result);
    const said = [await drop('no mesh', 'bad.obj'), await drop(CUBE, 'cube.obj')];
    if (!said[0].startsWith('bad.obj is not shown: it has no faces')) errors.push(`said: ${said[0]}`);
    if (said[1] || !document.getElementById('mesh_facts').textContent.startsWith('cube.obj: 12 triangles, 50 cm'))
      errors.push(`a file that is dropped is not taken: ${said[1]}`);
  }
  setTimeout(() => {
    result.errors = errors.length + (document.getElementById('message').hidden ? 0 : 1);
    const pre = document.createElement('pre');
    pre.id = 'result';
    pre.textContent = JSON.stringify(result);
    document.body.append(pre);
  }, 300);
});
