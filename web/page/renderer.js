// The room on a canvas by WebGL2: its surfaces by room.glsl over the tables of the volume as 3-D
// textures, the lamps' bodies and the backdrop by body.glsl, a mesh by mesh_renderer.js.

const MAX_LAMPS = 4;
const DEPTHS = [0.01, 200];  // nearest and farthest that is drawn, metres before the eye
const BACKDROP = 100;        // half a side of the box that is the backdrop, metres
const ROOM_AXES = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
const WHOLE_TARGET = `void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}`;

const vec3 = (v) => `vec3(${v.map(glslFloat)})`;

class Renderer {
  constructor(canvas, volume, shaders) {
    const gl = canvas.getContext('webgl2', { antialias: false, alpha: false });
    if (!gl) throw new Error('this browser has no WebGL2');
    Object.assign(this, { gl, canvas, volume, shaders, rooms: new Map(), mesh: null });
    // Where floats can be interpolated they are faster than half floats without a graphics processor.
    this.tableFormat = gl.getExtension('OES_texture_float_linear') ? gl.RGBA32F : gl.RGBA16F;
    this.textures = volume.tables.map((table) => this.uploadTable(table));
    this.light = lightShader(volume, this.textures.flat().map(({ scale }) => scale));
    const [near, far] = DEPTHS, depth = [(far + near) / (near - far), 2 * far * near / (near - far)];
    this.constants = `#define MAX_LAMPS ${MAX_LAMPS}
      #define SHADOW_RAYS ${SHADOW_RAYS}
      const vec2 DEPTH = vec2(${depth.map(glslFloat)});
      const vec4 SPHERE = vec4(${[...SPHERE.centre, SPHERE.radius].map(glslFloat)});
      const vec3 BOX_CENTRE = ${vec3(BOX.centre)}, BOX_HALF = ${vec3(BOX.half)};\n`;
    this.body = this.link(this.constants + shaders.corners, this.constants + shaders.body);
    this.probe = this.link(WHOLE_TARGET, this.light + shaders.probe);
    this.shapes = gl.createVertexArray();
    this.uploadShapes();
    this.room(0, 1, '');
  }

  link(...sources) {
    const { gl } = this;
    const program = gl.createProgram();
    sources.forEach((text, k) => {
      const shader = gl.createShader(k === 0 ? gl.VERTEX_SHADER : gl.FRAGMENT_SHADER);
      gl.shaderSource(shader, '#version 300 es\nprecision highp float;\nprecision highp int;\n'
        + `precision highp sampler2D;\nprecision highp sampler3D;\n${text}`);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS))
        throw new Error(`a shader does not compile: ${gl.getShaderInfoLog(shader)}`);
      gl.attachShader(program, shader);
    });
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS))
      throw new Error(`the shaders do not link: ${gl.getProgramInfoLog(program)}`);
    gl.useProgram(program);
    this.textures.flat().forEach(({ unit, name }) =>
      gl.uniform1i(gl.getUniformLocation(program, name), unit));
    const { delta, onF, onI } = this.volume;
    gl.uniform1f(gl.getUniformLocation(program, 'u_delta'), delta);
    gl.uniform4fv(gl.getUniformLocation(program, 'u_on_f'), onF);
    gl.uniform4fv(gl.getUniformLocation(program, 'u_on_i'), onI);
    return { program, places: new Map() };
  }

  // The program for what is shown by so many lamps of flat surfaces, of the sphere ('ON_SPHERE') or of a
  // mesh ('ON_MESH').
  room(mode, lamps, shape) {
    const { gl } = this, key = `${mode} ${lamps} ${shape} ${this.mesh !== null}`;
    if (!this.rooms.has(key)) {
      const each = Array.from({ length: lamps }, (_, k) =>
        `light_by(${k}, u_lamp_place[${k}], u_lamp_axes[${k}], u_lamp_level[${k}], p, n, own, lit);`);
      const shaped = (shape ? `#define ${shape}\n` : '') + this.constants;
      const shadow = this.mesh === null ? ''
        : `#define WITH_MESH\n#define MAP_SIZE ${glslFloat(MAP_SIZE)}\n${this.shaders.mesh_shadow}`;
      const room = this.link(shaped + this.shaders.corners, `#define MODE ${mode}
        #define BY_EACH_LAMP ${each.join(' ')}\n${shaped}${this.light}${shadow}${this.shaders.room}`);
      gl.uniform3fv(this.at(room, 'u_ramp'), RAMP.flat());
      gl.uniform3fv(this.at(room, 'u_weights'), LUMINANCE);
      this.rooms.set(key, room);
    }
    return this.rooms.get(key);
  }

  uploadShapes() {
    const { gl } = this;
    gl.bindVertexArray(this.shapes);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([...UNIT_CUBE, ...FLAT_SURFACES].flat()),
      gl.STATIC_DRAW);
    for (const [place, size, offset] of [[0, 3, 0], [1, 4, 12]]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 28, offset);
    }
  }

  at({ program, places }, name) {
    if (!places.has(name)) places.set(name, this.gl.getUniformLocation(program, name));
    return places.get(name);
  }

  // A texture for each channel: (K_x, K_y, K_z), scaled.
  uploadTable(table) {
    const { gl, volume } = this;
    const [x, y, w] = table.nodes.map((n) => n + 2);
    const textures = [];
    for (let channel = 0; channel < volume.channels; ++channel) {
      const { texels, scale } = texelsOf(table, channel);
      const unit = volume.channels * volume.tables.indexOf(table) + channel;
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_3D, gl.createTexture());
      gl.texImage3D(gl.TEXTURE_3D, 0, this.tableFormat, x, y, w, 0, gl.RGBA, gl.FLOAT, texels);
      for (const axis of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R])
        gl.texParameteri(gl.TEXTURE_3D, axis, gl.CLAMP_TO_EDGE);
      for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
        gl.texParameteri(gl.TEXTURE_3D, filter, gl.LINEAR);
      textures.push({ unit, name: `u_table_${unit}`, scale });
    }
    return textures;
  }

  use(one, view) {
    const { gl } = this;
    gl.useProgram(one.program);
    gl.uniform3fv(this.at(one, 'u_eye'), view.eye);
    gl.uniformMatrix3fv(this.at(one, 'u_view'), false, view.axes.flat());
    gl.uniform2fv(this.at(one, 'u_tangent'), view.tangents);
  }

  drawBox(program, centre, half, axes = ROOM_AXES, first = 0, count = UNIT_CUBE.length) {
    const { gl } = this;
    gl.uniform3fv(this.at(program, 'u_centre'), centre);
    gl.uniform3fv(this.at(program, 'u_half'), half);
    gl.uniformMatrix3fv(this.at(program, 'u_axes'), false, axes.flat());
    gl.drawArrays(gl.TRIANGLES, first, count);
  }

  drawMesh(program) {
    const { gl, mesh: { shape, mesh } } = this;
    gl.bindVertexArray(shape);
    this.drawBox(program, mesh.position, [1, 1, 1], ROOM_AXES, 0, 3 * mesh.count);
    gl.bindVertexArray(this.shapes);
  }

  // As they stand.
  drawFlatSurfaces(program) {
    this.drawBox(program, [0, 0, 0], [1, 1, 1], ROOM_AXES, UNIT_CUBE.length, FLAT_SURFACES.length);
  }

  // A mesh (mesh.js) among the surfaces from then on, or null. What cannot be drawn throws and leaves none.
  setMesh(mesh) {
    if (this.mesh) this.mesh.dispose();
    this.mesh = null;
    if (!mesh) return;
    this.mesh = new MeshRenderer(this, mesh);
    try {
      this.room(0, 1, 'ON_MESH');
    } catch (problem) {
      this.setMesh(null);
      throw problem;
    }
  }

  drawSurfaces(view, lamps, look, shape) {
    const { gl } = this, room = this.room(look.mode, lamps.length, shape);
    this.use(room, view);
    lamps.forEach((lamp, k) => {
      gl.uniform3fv(this.at(room, `u_lamp_place[${k}]`), lamp.position);
      gl.uniformMatrix3fv(this.at(room, `u_lamp_axes[${k}]`), false, lampAxes(lamp).flat());
      gl.uniform1f(this.at(room, `u_lamp_level[${k}]`), lamp.level);
    });
    gl.uniform1i(this.at(room, 'u_far_field'), look.farField ? 1 : 0);
    gl.uniform1f(this.at(room, 'u_exposure'), 1 / look.white);
    gl.uniform2fv(this.at(room, 'u_range'), look.range);
    if (this.mesh) this.mesh.set(room);
    if (shape === 'ON_SPHERE') this.drawBox(room, SPHERE.centre, Array(3).fill(SPHERE.radius));
    else if (shape === 'ON_MESH') this.drawMesh(room);
    else this.drawFlatSurfaces(room);
  }

  // The backdrop, and the nearest of the lamps' bodies, from F backwards.
  drawBodies(view, lamps) {
    const { gl, body, volume } = this, [mx, my, hx, hy] = volume.onF, depth = 0.6 * Math.max(hx, hy);
    this.use(body, view);
    gl.uniform1f(this.at(body, 'u_glow'), -1);
    this.drawBox(body, view.eye, Array(3).fill(BACKDROP));
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.cullFace(gl.BACK);
    const bodies = lamps.map((lamp) => {
      const axes = lampAxes(lamp);
      const centre = add(lamp.position, fromLamp(axes, [mx, my, -0.5 * depth]));
      return { axes, centre, level: lamp.level, away: Math.hypot(...add(centre, view.eye, -1)) };
    });
    for (const { axes, centre, level } of bodies.sort((a, b) => a.away - b.away)) {
      gl.uniform1f(this.at(body, 'u_glow'), Math.min(1, level));
      this.drawBox(body, centre, [hx, hy, 0.5 * depth], axes);
    }
    gl.disable(gl.BLEND);
  }

  // `view`: eye, axes (right, up, back), tangent; `look`: mode, farField, white, range.
  draw(width, height, { eye, axes, tangent }, lamps, look) {
    const { gl, canvas } = this;
    const view = { eye, axes, tangents: [tangent * width / height, tangent] };
    if (canvas.width !== width || canvas.height !== height)
      Object.assign(canvas, { width, height });
    if (this.mesh) this.mesh.update(lamps);
    gl.viewport(0, 0, width, height);
    gl.bindVertexArray(this.shapes);
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.disable(gl.CULL_FACE);
    this.drawSurfaces(view, lamps, look, '');
    if (this.mesh) this.drawSurfaces(view, lamps, look, 'ON_MESH');
    gl.enable(gl.CULL_FACE);
    gl.cullFace(gl.FRONT);
    this.drawSurfaces(view, lamps, look, 'ON_SPHERE');
    this.drawBodies(view, lamps);
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.CULL_FACE);
  }

  // Resolves when what was drawn is there, so that the time it took can be told.
  finished() {
    const { gl } = this;
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    return new Promise((resolve) => {
      const look = () => {
        const status = gl.clientWaitSync(fence, 0, 0);
        if (status === gl.TIMEOUT_EXPIRED) {
          setTimeout(look, 1);
        } else {
          gl.deleteSync(fence);
          resolve();
        }
      };
      setTimeout(look, 0);
    });
  }

  // Stands still until the picture is there.
  waitForPixel() {
    const { gl } = this;
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  }

  // n . J of receivers [[p, n], ...] by the shader, as luminance weighs the channels; null where
  // nothing can be drawn into floats.
  illuminances(receivers) {
    const { gl, probe } = this;
    if (!gl.getExtension('EXT_color_buffer_float')) return null;
    const count = receivers.length, units = this.textures.flat().length;
    const data = new Float32Array(8 * count);
    receivers.forEach(([p, n], k) => {
      data.set(p, 4 * k);
      data.set(n, 4 * (count + k));
    });
    const texture = (unit, format, width, height, source) => {
      const one = gl.createTexture();
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, one);
      gl.texImage2D(gl.TEXTURE_2D, 0, format, width, height, 0, gl.RGBA, gl.FLOAT, source);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
      return one;
    };
    const input = texture(units, gl.RGBA32F, count, 2, data);
    const output = texture(units + 1, gl.RGBA32F, count, 1, null);
    const frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, output, 0);
    gl.viewport(0, 0, count, 1);
    gl.bindVertexArray(null);
    gl.useProgram(probe.program);
    gl.uniform1i(this.at(probe, 'u_receivers'), units);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    const pixels = new Float32Array(4 * count);
    gl.readPixels(0, 0, count, 1, gl.RGBA, gl.FLOAT, pixels);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(frame);
    gl.deleteTexture(input);
    gl.deleteTexture(output);
    return receivers.map((receiver, k) => dot(LUMINANCE, pixels.subarray(4 * k, 4 * k + 3)));
  }
}
