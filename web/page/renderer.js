// The room on a canvas by WebGL2: one pass of room.glsl over the tables of the volume as 3-D textures
// of half floats.

const MAX_LAMPS = 4;
const VERTICES = `#version 300 es
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}`;

class Renderer {
  constructor(canvas, volume, shaders) {
    const gl = canvas.getContext('webgl2', { antialias: false, alpha: false });
    if (!gl) throw new Error('this browser has no WebGL2');
    Object.assign(this, { gl, canvas, volume });
    this.textures = volume.tables.map((table) => this.uploadTable(table));
    const light = lightShader(volume, this.textures.flat().map(({ scale }) => scale));
    const defines = `#define MAX_LAMPS ${MAX_LAMPS}\n#define SHADOW_RAYS ${SHADOW_RAYS}\n`;
    this.room = this.link(defines + light + shaders.room);
    this.probe = this.link(light + shaders.probe);
    gl.bindVertexArray(gl.createVertexArray());
    this.setRoom();
  }

  link(fragments) {
    const { gl } = this;
    const program = gl.createProgram();
    const source = '#version 300 es\nprecision highp float;\nprecision highp int;\n'
      + `precision highp sampler2D;\nprecision highp sampler3D;\n${fragments}`;
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTICES], [gl.FRAGMENT_SHADER, source]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS))
        throw new Error(`a shader does not compile: ${gl.getShaderInfoLog(shader)}`);
      gl.attachShader(program, shader);
    }
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
      gl.texImage3D(gl.TEXTURE_3D, 0, gl.RGBA16F, x, y, w, 0, gl.RGBA, gl.FLOAT, texels);
      for (const axis of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R])
        gl.texParameteri(gl.TEXTURE_3D, axis, gl.CLAMP_TO_EDGE);
      for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
        gl.texParameteri(gl.TEXTURE_3D, filter, gl.LINEAR);
      textures.push({ unit, name: `u_table_${unit}`, scale });
    }
    return textures;
  }

  setRoom() {
    const { gl, room } = this;
    gl.useProgram(room.program);
    gl.uniform4f(this.at(room, 'u_room'), ROOM.half, ROOM.wallZ, ROOM.wallHeight, 0);
    gl.uniform4f(this.at(room, 'u_sphere'), ...SPHERE.centre, SPHERE.radius);
    gl.uniform3f(this.at(room, 'u_box_centre'), ...BOX.centre);
    gl.uniform3f(this.at(room, 'u_box_half'), ...BOX.half);
    gl.uniform3fv(this.at(room, 'u_ramp'), RAMP.flat());
    gl.uniform3fv(this.at(room, 'u_weights'), LUMINANCE);
  }

  // `view`: eye, axes (right, up, back), tangent; `look`: mode, farField, white, range.
  draw(width, height, view, lamps, look) {
    const { gl, room, canvas } = this;
    if (canvas.width !== width || canvas.height !== height)
      Object.assign(canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.useProgram(room.program);
    gl.uniform2f(this.at(room, 'u_size'), width, height);
    gl.uniform3fv(this.at(room, 'u_eye'), view.eye);
    gl.uniformMatrix3fv(this.at(room, 'u_view'), false, view.axes.flat());
    gl.uniform1f(this.at(room, 'u_tangent'), view.tangent);
    gl.uniform1i(this.at(room, 'u_lamps'), lamps.length);
    lamps.forEach((lamp, k) => {
      gl.uniform3fv(this.at(room, `u_lamp_place[${k}]`), lamp.position);
      gl.uniformMatrix3fv(this.at(room, `u_lamp_axes[${k}]`), false, lampAxes(lamp).flat());
      gl.uniform1f(this.at(room, `u_lamp_level[${k}]`), lamp.level);
    });
    gl.uniform1i(this.at(room, 'u_mode'), look.mode);
    gl.uniform1i(this.at(room, 'u_far_field'), look.farField ? 1 : 0);
    gl.uniform1f(this.at(room, 'u_exposure'), 1 / look.white);
    gl.uniform2fv(this.at(room, 'u_range'), look.range);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
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
