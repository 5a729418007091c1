// The page: its state, its controls, what pointers do, and window.luxfield for whoever asks it.

const START = { position: [0.1, 0.75, 0], yaw: 0, pitch: -0.04, level: 1 };
const VIEW = { target: [0.25, 0.6, -1.35], turn: 0.7, lift: 0.38, distance: 4.6, tangent: 0.42 };
const FRAME_MS = 40;            // a frame while something moves should take no longer
const DECADES = 4;              // of false colour

// From dark blue to pale yellow, each lighter than the one before.
const RAMP = [[0.09, 0.10, 0.32], [0.13, 0.25, 0.56], [0.10, 0.42, 0.66], [0.09, 0.58, 0.62],
  [0.28, 0.72, 0.47], [0.62, 0.82, 0.32], [0.93, 0.87, 0.35], [1.0, 0.97, 0.80]];

const element = (id) => document.getElementById(id);
const stated = JSON.parse(element('lamp').textContent);
const state = { lamps: [structuredClone(START)], chosen: 0, view: structuredClone(VIEW), mode: 0,
  farField: false, pointer: null };
let volume = null, renderer = null;

// ---- numbers ----

// Three digits, more where the uncertainty bears them, with thin spaces between thousands.
function figure(x, digits = 3) {
  if (!(Math.abs(x) > 0)) return '0';
  const exponent = Math.floor(Math.log10(Math.abs(x)));
  if (exponent < -4 || exponent > 7) return x.toExponential(digits - 1).replace('e', ' e');
  const rounded = x.toFixed(Math.max(0, digits - 1 - exponent));
  return rounded.replace(/\B(?=(\d{3})+(?!\d))(?<!\.\d*)/g, '\u2009');
}

const percent = (share) => (share < 0.1 ? figure(100 * share, 2) : (100 * share).toFixed(0)) + '\u2009%';
const metres = (x) => (x < 1 ? `${(100 * x).toFixed(x < 0.1 ? 1 : 0)} cm` : `${x.toFixed(2)} m`);
const degrees = (x) => `${(x * 180 / Math.PI).toFixed(0)}\u00b0`;

// ---- the lamp's sliders: from 0 to 1000, mapped by `to` and `from` ----

const logarithmic = (lo, hi) => ({ to: (t) => lo * (hi / lo) ** t, from: (x) => Math.log(x / lo) / Math.log(hi / lo) });
const linear = (lo, hi) => ({ to: (t) => lo + (hi - lo) * t, from: (x) => (x - lo) / (hi - lo) });
const SLIDERS = {
  distance: { ...logarithmic(0.02, 6), text: metres, get: (lamp) => lamp.position[2] - ROOM.wallZ,
    set: (lamp, x) => { lamp.position[2] = ROOM.wallZ + x; } },
  side: { ...linear(-2.5, 2.5), text: (x) => `${x.toFixed(2)} m`, get: (lamp) => lamp.position[0],
    set: (lamp, x) => { lamp.position[0] = x; } },
  height: { ...linear(0.02, 2.8), text: metres, get: (lamp) => lamp.position[1],
    set: (lamp, x) => { lamp.position[1] = x; } },
  yaw: { ...linear(-Math.PI, Math.PI), text: degrees, get: (lamp) => lamp.yaw,
    set: (lamp, x) => { lamp.yaw = x; } },
  pitch: { ...linear(-Math.PI / 2, Math.PI / 2), text: degrees, get: (lamp) => lamp.pitch,
    set: (lamp, x) => { lamp.pitch = x; } },
  level: { ...linear(0, 1), text: (x) => `${(100 * x).toFixed(0)} %`, get: (lamp) => lamp.level,
    set: (lamp, x) => { lamp.level = x; } },
};

function showSliders() {
  const lamp = state.lamps[state.chosen];
  for (const [name, slider] of Object.entries(SLIDERS)) {
    const input = element(name), value = slider.get(lamp);
    input.value = 1000 * Math.min(1, Math.max(0, slider.from(value)));
    input.previousElementSibling.querySelector('output').textContent = slider.text(value);
  }
  const tabs = element('lamp_tabs');
  tabs.replaceChildren(...(state.lamps.length < 2 ? [] : state.lamps.map((one, k) => {
    const tab = document.createElement('button');
    tab.textContent = k + 1;
    tab.setAttribute('aria-pressed', k === state.chosen);
    tab.onclick = () => { state.chosen = k; showSliders(); };
    return tab;
  })));
  element('add').disabled = state.lamps.length >= MAX_LAMPS;
  element('remove').disabled = state.lamps.length < 2;
}

// ---- how bright it is: what shows white, and the range of false colour ----

let look = null; // of the lamps as they stand; null when they have moved

function measureLook() {
  const readings = [];
  for (let j = 0; j < 12; ++j)
    for (let i = 0; i < 18; ++i) {
      const x = (i + 0.5) / 9 - 1, y = (j + 0.5) / 12;
      for (const place of [{ p: [3 * x, 2.6 * y, ROOM.wallZ], n: [0, 0, 1], name: 'wall' },
        { p: [2.5 * x, 0, ROOM.wallZ + 5 * y], n: [0, 1, 0], name: 'floor' }]) {
        let sum = 0;
        for (const lamp of state.lamps) {
          const axes = lampAxes(lamp);
          sum += lamp.level * Math.max(0, volume.illuminance(
            toLamp(axes, add(place.p, lamp.position, -1)), toLamp(axes, place.n), state.farField));
        }
        if (sum > 0) readings.push(sum);
      }
    }
  // And where the lamps' axes meet the room, which a grid may miss.
  for (const lamp of state.lamps) {
    const axes = lampAxes(lamp), hit = hitRoom(add(lamp.position, axes[2], 1e-3), axes[2]);
    if (!hit) continue;
    const e = lamp.level * volume.illuminance(toLamp(axes, add(hit.p, lamp.position, -1)),
      toLamp(axes, hit.n), state.farField);
    if (e > 0) readings.push(e);
  }
  readings.sort((a, b) => a - b);
  const at = (share) => readings[Math.floor(share * (readings.length - 1))] || 1;
  const top = Math.ceil(3 * Math.log10(at(1))) / 3;
  return { white: Math.max(at(0.97), at(1) / 30), range: [top - DECADES, top] };
}

function showLegend() {
  const legend = element('legend');
  legend.classList.toggle('shown', state.mode !== 0);
  if (state.mode === 0 || !look) return;
  const bar = element('scale'), draw = bar.getContext('2d');
  for (let y = 0; y < bar.height; ++y) {
    const t = 1 - (y + 0.5) / bar.height;
    draw.fillStyle = `rgb(${(state.mode === 1 ? rampColour(t) : deviationColour(t - 0.5))
      .map((c) => Math.round(255 * c)).join(' ')})`;
    draw.fillRect(0, y, bar.width, 1);
  }
  const ticks = [];
  if (state.mode === 1) {
    const [lo, hi] = look.range;
    for (let k = Math.ceil(lo); k <= hi; ++k)
      ticks.push([(hi - k) / (hi - lo), `${figure(10 ** k, 1)} ${stated.unit}`]);
  } else {
    for (const share of [0.5, 0.25, 0, -0.25, -0.5])
      ticks.push([0.5 - share, `${share > 0 ? '+' : ''}${100 * share} %`]);
  }
  element('ticks').replaceChildren(...ticks.map(([place, text]) => {
    const tick = document.createElement('li');
    tick.style.top = `${100 * place}%`;
    tick.textContent = text;
    return tick;
  }));
}

function rampColour(t) {
  const x = 7 * Math.min(1, Math.max(0, t)), k = Math.min(6, Math.floor(x));
  return RAMP[k].map((c, i) => c + (x - k) * (RAMP[k + 1][i] - c));
}

function deviationColour(share) {
  const t = Math.min(1, Math.max(-1, 2 * share));
  const full = t < 0 ? [0.02, 0.24, 0.60] : [0.70, 0.09, 0.06];
  return full.map((c) => 0.96 + Math.abs(t) ** 0.7 * (c - 0.96));
}

// ---- frames: drawn when something changed, coarser while it moves if they take too long ----

let coarseness = 1, frameAsked = false, askedAgain = false, restTimer = 0;

function viewAxes() {
  const { turn, lift } = state.view;
  const back = [Math.sin(turn) * Math.cos(lift), Math.sin(lift), Math.cos(turn) * Math.cos(lift)];
  const right = [Math.cos(turn), 0, -Math.sin(turn)];
  return [right, cross(back, right), back];
}

function eyeOf(axes) { return add(state.view.target, axes[2], state.view.distance); }

function drawFrame(scale) {
  const box = element('view').getBoundingClientRect();
  const ratio = Math.min(2, window.devicePixelRatio || 1) * scale;
  const axes = viewAxes();
  // Upright screens see as much to the sides as square ones.
  const tangent = state.view.tangent * Math.max(1, 0.95 * box.height / Math.max(1, box.width));
  state.tangentNow = tangent;
  look ||= measureLook();
  renderer.draw(Math.max(1, Math.round(box.width * ratio)), Math.max(1, Math.round(box.height * ratio)),
    { eye: eyeOf(axes), axes, tangent }, state.lamps, { ...look, mode: state.mode, farField: state.farField });
}

async function frame() {
  const began = performance.now();
  drawFrame(coarseness);
  showLegend();
  showReading();
  await renderer.finished();
  frameAsked = false;
  const took = performance.now() - began;
  if (took > FRAME_MS) coarseness = Math.max(0.25, coarseness * Math.sqrt(0.8 * FRAME_MS / took));
  else if (took < FRAME_MS / 3) coarseness = Math.min(1, coarseness * 1.2);
  clearTimeout(restTimer);
  restTimer = setTimeout(() => drawFrame(1), 180);
  if (askedAgain) ask();
}

function ask({ lampsMoved = false } = {}) {
  if (lampsMoved) look = null;
  askedAgain = frameAsked;
  if (!renderer || frameAsked) return;
  frameAsked = true;
  requestAnimationFrame(frame);
}

// ---- pointers ----

function rayAt(clientX, clientY) {
  const box = element('view').getBoundingClientRect(), axes = viewAxes();
  const x = (2 * (clientX - box.left) / box.width - 1) * box.width / box.height * state.tangentNow;
  const y = (1 - 2 * (clientY - box.top) / box.height) * state.tangentNow;
  return { origin: eyeOf(axes), direction: normalised(add(add(add([0, 0, 0], axes[0], x), axes[1], y), axes[2], -1)) };
}

// The lamp under a ray: its number, or -1.
function lampAt({ origin, direction }) {
  const [mx, my, hx, hy] = volume.onF, depth = 0.6 * Math.max(hx, hy);
  return state.lamps.findIndex((lamp) => {
    const axes = lampAxes(lamp);
    const grip = 1.25; // easier to take hold of
    return hitBox(toLamp(axes, add(origin, lamp.position, -1)), toLamp(axes, direction),
      { centre: [mx, my, -0.5 * depth], half: [grip * hx, grip * hy, grip * depth] }) < Infinity;
  });
}

function showReading() {
  if (!state.pointer) return;
  const hit = hitRoom(...Object.values(rayAt(...state.pointer)));
  if (!hit) return;
  const reading = readingAt(volume, state.lamps, hit), unit = stated.unit;
  const share = reading.uncertainty / reading.illuminance;
  const digits = share > 0 && share < 0.5 ? Math.min(5, Math.max(2, 1 + Math.ceil(-Math.log10(share)))) : 2;
  const value = `<b>${figure(reading.illuminance, digits)}\u2009${unit}</b>`;
  const error = reading.illuminance > 0 && !reading.estimate
    ? ` \u00b1\u2009${figure(reading.uncertainty, 2)}\u2009${unit}` : '';
  const notes = [`on the ${hit.name}`];
  if (reading.estimate) notes.push(reading.shadowed ? 'half shadow: an estimate' : 'the horizon cuts the lamp: an estimate');
  else if (reading.shadowed) notes.push('in shadow');
  if (reading.illuminance > 0)
    notes.push(`point lamp: ${figure(reading.farField)}\u2009${unit} (${reading.farField >= reading.illuminance ? '+' : '\u2212'}`
      + `${percent(Math.abs(reading.farField / reading.illuminance - 1))})`);
  element('reading').innerHTML = `${value}${error}<br><span class="more">${notes.join(' \u00b7 ')}</span>`;
}

// Moves a position in the horizontal plane of that height, where both rays meet it.
function drag(position, height, toWall, from, to) {
  const at = (ray) => {
    const t = (height - ray.origin[1]) / ray.direction[1];
    return t > 0 && t < 20 ? add(ray.origin, ray.direction, t) : null;
  };
  const a = at(from), b = at(to);
  if (!a || !b) return;
  position[0] = Math.min(2.5, Math.max(-2.5, position[0] + b[0] - a[0]));
  position[2] = Math.min(ROOM.wallZ + 6, Math.max(ROOM.wallZ + toWall, position[2] + b[2] - a[2]));
}

function zoom(factor) { state.view.distance = Math.min(12, Math.max(0.6, state.view.distance * factor)); }

function listenToPointers() {
  const canvas = element('view'), down = new Map();
  let held = -1, grip = null;  // a lamp; where the mesh is held
  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, [event.clientX, event.clientY]);
    state.pointer = [event.clientX, event.clientY];
    if (down.size === 1) {
      const ray = rayAt(event.clientX, event.clientY), hit = hitRoom(ray.origin, ray.direction);
      held = lampAt(ray);
      grip = held < 0 && hit && hit.name === 'mesh' ? hit.p : null;
    }
    if (held >= 0) { state.chosen = held; showSliders(); }
    canvas.classList.add('dragging');
    ask();
  });
  canvas.addEventListener('pointermove', (event) => {
    const before = down.get(event.pointerId), now = [event.clientX, event.clientY];
    state.pointer = now;
    if (!before) {
      canvas.style.cursor = lampAt(rayAt(...now)) >= 0 ? 'move' : '';
      showReading();
      return;
    }
    if (down.size === 2) {
      const other = [...down].find(([id]) => id !== event.pointerId)[1];
      const apart = (p) => Math.max(10, Math.hypot(p[0] - other[0], p[1] - other[1]));
      zoom(apart(before) / apart(now));
    } else if (held >= 0) {
      const { position } = state.lamps[held];
      drag(position, position[1], 0.02, rayAt(...before), rayAt(...now));
      showSliders();
    } else if (grip) {
      drag(ROOM.mesh.position, grip[1], ROOM.mesh.half[2], rayAt(...before), rayAt(...now));
    } else {
      state.view.turn -= 0.006 * (now[0] - before[0]);
      state.view.lift = Math.min(1.45, Math.max(0.02, state.view.lift + 0.006 * (now[1] - before[1])));
    }
    down.set(event.pointerId, now);
    ask({ lampsMoved: held >= 0 || grip !== null });
  });
  for (const ending of ['pointerup', 'pointercancel'])
    canvas.addEventListener(ending, (event) => {
      down.delete(event.pointerId);
      if (down.size === 0) { held = -1; grip = null; canvas.classList.remove('dragging'); }
    });
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    zoom(Math.exp(0.001 * event.deltaY));
    ask();
  }, { passive: false });
  canvas.addEventListener('keydown', (event) => {
    const step = { ArrowLeft: [0.08, 0], ArrowRight: [-0.08, 0], ArrowUp: [0, 0.06], ArrowDown: [0, -0.06] }[event.key];
    if (step) {
      state.view.turn += step[0];
      state.view.lift = Math.min(1.45, Math.max(0.02, state.view.lift + step[1]));
    } else if (event.key === '+' || event.key === '-') zoom(event.key === '+' ? 0.9 : 1.1);
    else return;
    event.preventDefault();
    ask();
  });
}

// ---- a mesh that is dropped in ----

let meshFile = null;  // { text, name, options } of the mesh that stands there

function showMesh() {
  const mesh = ROOM.mesh, size = mesh && [0, 1, 2].map((k) => metres(2 * mesh.half[k])).join(' \u00d7 ');
  element('mesh_remove').disabled = !mesh;
  element('mesh_facts').textContent = mesh ? `${mesh.name}: ${mesh.count} triangles, ${size}`
    + `${mesh.scale === 1 ? '' : `, scaled by ${figure(mesh.scale)}`}. Drag it to move it.`
    : 'A Wavefront file in metres, at most 50 000 triangles; also dropped on the picture.';
  ask({ lampsMoved: true });
}

// Puts the mesh of a file's text in the place of the one that stood there. On an Error by the file, none is
// changed.
function addMesh(text, name, options = {}) {
  const mesh = makeMesh(text, name, { zUp: element('mesh_z_up').checked, ...options });
  removeMesh();
  if (renderer) renderer.setMesh(mesh);
  ROOM.mesh = mesh;
  meshFile = { text, name, options };
  element('message').hidden = true;
  showMesh();
  return { triangles: mesh.count, scale: mesh.scale, size: mesh.half.map((x) => 2 * x), position: mesh.position };
}

function removeMesh() {
  if (renderer) renderer.setMesh(null);
  ROOM.mesh = meshFile = null;
  showMesh();
}

async function takeFile(file) {
  try {
    if (file.size > MESH_LIMITS.bytes) throw new Error('it is larger than 20 MB');
    addMesh(await file.text(), file.name);
  } catch (problem) {
    say(`${file.name} is not shown: ${problem.message}.`);
  }
}

function listenToMeshes() {
  const stage = element('stage'), chosen = element('mesh_file');
  stage.addEventListener('dragover', (event) => event.preventDefault());
  stage.addEventListener('drop', (event) => {
    event.preventDefault();
    if (event.dataTransfer.files.length > 0) takeFile(event.dataTransfer.files[0]);
  });
  element('mesh_drop').onclick = () => chosen.click();
  chosen.addEventListener('change', () => {
    if (chosen.files.length > 0) takeFile(chosen.files[0]);
    chosen.value = '';
  });
  element('mesh_remove').onclick = removeMesh;
  element('mesh_z_up').addEventListener('change', () => {
    if (meshFile) addMesh(meshFile.text, meshFile.name, { ...meshFile.options,
      zUp: element('mesh_z_up').checked, at: [ROOM.mesh.position[0], ROOM.mesh.position[2]] });
  });
  showMesh();
}

function listenToControls() {
  for (const [name, slider] of Object.entries(SLIDERS)) {
    element(name).addEventListener('input', (event) => {
      slider.set(state.lamps[state.chosen], slider.to(event.target.value / 1000));
      showSliders();
      ask({ lampsMoved: true });
    });
  }
  for (const input of document.querySelectorAll('input[name="mode"]'))
    input.addEventListener('change', () => { state.mode = Number(input.value); ask(); });
  element('far_field').addEventListener('change', (event) => {
    state.farField = event.target.checked;
    ask({ lampsMoved: true });
  });
  element('add').onclick = () => {
    const lamp = structuredClone(state.lamps[state.chosen]);
    lamp.position[0] += lamp.position[0] > 0 ? -0.7 : 0.7;
    state.chosen = state.lamps.push(lamp) - 1;
    showSliders();
    ask({ lampsMoved: true });
  };
  element('remove').onclick = () => {
    state.lamps.splice(state.chosen, 1);
    state.chosen = 0;
    showSliders();
    ask({ lampsMoved: true });
  };
  element('reset').onclick = () => {
    Object.assign(state, { lamps: [structuredClone(START)], chosen: 0, view: structuredClone(VIEW) });
    showSliders();
    ask({ lampsMoved: true });
  };
  new ResizeObserver(() => {
    drawFrame(1);
    showLegend();
  }).observe(element('view'));
}

// ---- beginning ----

function say(text) { Object.assign(element('message'), { textContent: text, hidden: false }); }

async function begin() {
  volume = await LampVolume.decode(stated);
  for (const name of Object.keys(SLIDERS)) Object.assign(element(name), { min: 0, max: 1000, step: 1 });
  showSliders();
  try {
    renderer = new Renderer(element('view'), volume, SHADERS);
  } catch (problem) {
    say(`No picture here: ${problem.message}. Readings by window.luxfield work all the same.`);
    return;
  }
  listenToControls();
  listenToPointers();
  listenToMeshes();
}

const ready = begin();
ready.catch((problem) => say(`The lamp in this page cannot be read: ${problem.message}.`));

// What programs may ask: docs/web.md, "The page's interface". Luminaire's frame, metres.
window.luxfield = {
  ready,
  unit: stated.unit,
  statedError: stated.stated_error,
  zones: stated.zones,
  illuminance: (p, n) => volume.illuminance(p, n),
  farFieldIlluminance: (p, n) => volume.illuminance(p, n, true),
  uncertainty: (p, n) => volume.uncertainty(p, n),
  shaderIlluminances: (receivers) => renderer && renderer.illuminances(receivers),
  addMesh,
  removeMesh,
  // What a ray of the room's frame meets: { name, p, n, illuminance, uncertainty, ... }, or null.
  readingAlong(origin, direction) {
    const hit = hitRoom(origin, normalised(direction));
    return hit && { ...hit, ...readingAt(volume, state.lamps, hit) };
  },
  // Milliseconds of a frame of that size, the fastest of `frames`.
  frameTime(width, height, frames = 5) {
    const axes = viewAxes();
    let fastest = Infinity;
    for (let k = 0; k < frames; ++k) {
      const began = performance.now();
      renderer.draw(width, height, { eye: eyeOf(axes), axes, tangent: state.view.tangent }, state.lamps,
        { ...(look ||= measureLook()), mode: state.mode, farField: state.farField });
      renderer.waitForPixel();
      fastest = Math.min(fastest, performance.now() - began);
    }
    ask();
    return fastest;
  },
};
