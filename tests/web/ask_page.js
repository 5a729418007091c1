// Asks the page for the illuminance at RECEIVERS and writes what it finds into the page.
const errors = [];
window.addEventListener('error', (event) => errors.push(event.message));
window.addEventListener('unhandledrejection', (event) => errors.push(String(event.reason)));
window.luxfield.ready.then(() => {
  const { illuminance, zones, shaderIlluminances } = window.luxfield;
  const result = { receivers: RECEIVERS.length, of_stated: 0, worst: 0, shader: 0, errors: 0 };
  const drawn = shaderIlluminances(RECEIVERS.map(({ p, n }) => [p, n]));
  if (!drawn) result.shader = null;
  RECEIVERS.forEach(({ p, n, exact, brightest }, k) => {
    const read = illuminance(p, n), unit = Math.max(Math.abs(exact), 0.1 * brightest);
    result.worst = Math.max(result.worst, Math.abs(read - exact) / unit);
    const zone = zones.find((one) => p[2] <= one.z_last_m);
    result.of_stated = Math.max(result.of_stated, Math.abs(read - exact) / (unit * zone.stated_error));
    if (drawn) result.shader = Math.max(result.shader, Math.abs(drawn[k] - read) / unit);
  });
  result.zones_worst = Math.max(...zones.map((zone) => zone.stated_error));
  result.requests = performance.getEntriesByType('resource').length;
  setTimeout(() => {
    result.errors = errors.length + (document.getElementById('message').hidden ? 0 : 1);
    const pre = document.createElement('pre');
    pre.id = 'result';
    pre.textContent = JSON.stringify(result);
    document.body.append(pre);
  }, 300);
});
