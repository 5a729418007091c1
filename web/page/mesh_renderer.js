// A mesh among the surfaces of the room: its corners, and depth maps of it from the points on F of each
// lamp, which are drawn anew when the lamp or the mesh has moved.

const MAP_SIZE = 512;          // texels along a side of a depth map
const MAPS_OF_LAMP = SHADOW_RAYS * SHADOW_RAYS;
const WIDEST_MAP = 4;          // tangent off the lamp's axis up to which the mesh is seen
const NEAREST_IN_MAP = 1e-3;   // metres before F

// What a point sees of a box in its axes: the window of x / z and y / z as scale and offset to 0 .. 1,
// and the depth as a + b / z from 0 to 1.
function mapOfCorners(corners) {
  const z = corners.map((corner) => corner[2]);
  const near = Math.max(NEAREST_IN_MAP, 0.999 * Math.min(...z));
  const far = Math.max(1.001 * near, 1.001 * Math.max(...z));
  const window = [0, 1].map((k) => {
    if (Math.min(...z) <= NEAREST_IN_MAP) return [-WIDEST_MAP, WIDEST_MAP];
    const at = corners.map((corner) => Math.min(WIDEST_MAP, Math.max(-WIDEST_MAP, corner[k] / corner[2])));
    const lo = Math.min(...at), hi = Math.max(...at), margin = 1e-3 + 0.01 * (hi - lo);
    return [lo - margin, hi + margin];
  });
  const scale = window.map(([lo, hi]) => 1 / (hi - lo));
  return { window: [...scale, ...window.map(([lo], k) => -lo * scale[k])],
    depth: [far / (far - near), -far * near / (far - near)] };
}

class MeshRenderer {
  constructor(renderer, mesh) {
    const { gl } = renderer;
    Object.assign(this, { renderer, gl, mesh, lamps: 0, drawn: [], unit: renderer.textures.flat().length,
      windows: new Float32Array(4 * MAX_LAMPS * MAPS_OF_LAMP),
      depths: new Float32Array(2 * MAX_LAMPS * MAPS_OF_LAMP) });
    this.program = renderer.link(renderer.shaders.mesh_depth, 'void main() {}');
    this.frame = gl.createFramebuffer();
    this.shape = gl.createVertexArray();
    this.buffer = gl.createBuffer();
    this.uploadShape();
  }

  uploadShape() {
    const { gl, mesh: { count, places, facets, smooths } } = this, data = new Float32Array(30 * count);
    for (let k = 0; k < 3 * count; ++k)
      for (let c = 0; c < 3; ++c) {
        data[10 * k + c] = places[3 * k + c];
        data[10 * k + 3 + c] = facets[3 * k + c];
        data[10 * k + 7 + c] = smooths[3 * k + c];
      }
    for (let k = 0; k < 3 * count; ++k) data[10 * k + 6] = 4;  // the surface
    gl.bindVertexArray(this.shape);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    for (const [place, size, offset] of [[0, 3, 0], [1, 4, 12], [2, 3, 28]]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 40, offset);
    }
  }

  makeMaps(lamps) {
    const { gl } = this;
    gl.deleteTexture(this.maps || null);
    Object.assign(this, { lamps, drawn: [], maps: gl.createTexture() });
    gl.activeTexture(gl.TEXTURE0 + this.unit);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.maps);
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.DEPTH_COMPONENT24, MAP_SIZE, MAP_SIZE, lamps * MAPS_OF_LAMP);
    const set = (name, value) => gl.texParameteri(gl.TEXTURE_2D_ARRAY, name, value);
    set(gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
    set(gl.TEXTURE_COMPARE_FUNC, gl.LEQUAL);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) set(name, gl.LINEAR);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) set(name, gl.CLAMP_TO_EDGE);
  }

  // Draws the maps of lamps that stand otherwise than when their maps were drawn.
  update(lamps) {
    const { gl, mesh, renderer } = this;
    if (lamps.length !== this.lamps) this.makeMaps(lamps.length);
    const moved = lamps.map((lamp) => JSON.stringify([lamp.position, lamp.yaw, lamp.pitch, mesh.position]));
    if (moved.every((pose, k) => pose === this.drawn[k])) return;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.drawBuffers([gl.NONE]);
    gl.viewport(0, 0, MAP_SIZE, MAP_SIZE);
    gl.bindVertexArray(this.shape);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.CULL_FACE);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 2);
    gl.useProgram(this.program.program);
    gl.uniform3fv(renderer.at(this.program, 'u_centre'), mesh.position);
    lamps.forEach((lamp, k) => { if (moved[k] !== this.drawn[k]) this.drawMaps(lamp, k); });
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    this.drawn = moved;
  }

  drawMaps(lamp, number) {
    const { gl, mesh, renderer, program } = this, axes = lampAxes(lamp);
    gl.uniformMatrix3fv(renderer.at(program, 'u_axes'), false, axes.flat());
    pointsOnF(renderer.volume, lamp, axes).forEach((from, k) => {
      const map = number * MAPS_OF_LAMP + k, to = add(mesh.position, from, -1);
      const corners = Array.from({ length: 8 }, (_, corner) => toLamp(axes,
        to.map((x, c) => x + (corner >> c & 1 ? 1 : -1) * mesh.half[c])));
      const { window, depth } = mapOfCorners(corners);
      this.windows.set(window, 4 * map);
      this.depths.set(depth, 2 * map);
      gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, this.maps, 0, map);
      gl.clear(gl.DEPTH_BUFFER_BIT);
      gl.uniform3fv(renderer.at(program, 'u_from'), from);
      gl.uniform4fv(renderer.at(program, 'u_window'), window);
      gl.uniform2fv(renderer.at(program, 'u_depth'), depth);
      gl.drawArrays(gl.TRIANGLES, 0, 3 * mesh.count);
    });
  }

  // The uniforms of a program that shows the mesh's shadow.
  set(program) {
    const { gl, mesh, renderer } = this;
    gl.uniform4fv(renderer.at(program, 'u_mesh_ball'), [...mesh.position, mesh.radius]);
    gl.uniform1i(renderer.at(program, 'u_maps'), this.unit);
    gl.uniform4fv(renderer.at(program, 'u_map_window'), this.windows);
    gl.uniform2fv(renderer.at(program, 'u_map_depth'), this.depths);
  }

  dispose() {
    const { gl } = this;
    gl.deleteTexture(this.maps || null);
    gl.deleteFramebuffer(this.frame);
    gl.deleteBuffer(this.buffer);
    gl.deleteVertexArray(this.shape);
    gl.deleteProgram(this.program.program);
  }
}
