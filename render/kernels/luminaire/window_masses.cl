// The windows of all images seen from a batch of pixels: their spans per axis, then their masses.
// Neighbouring items follow each other on one row of images, whose entries stay in the cache.
#include "luxfield/render/kernels/luminaire/shadow_maps.clh"
#include "luxfield/render/kernels/luminaire/window_sampling.clh"
#include "luxfield/render/kernels/sample/light_task.clh"

// Item (pixel, dimension): spans of the columns or of the rows. Nothing is seen by pixels that hit
// nothing or lie behind the luminaire.
__kernel void WindowSpans(__constant const LuminaireParams* luminaire,
                          __constant const SamplingParams* sampling, TASK_ARGUMENTS,
                          __global const float4* positions, __global int4* spans) {
  const int item = get_global_id(0), dimension = get_global_id(1), pixel = sampling->begin + item;
  if (pixel >= sampling->end) return;
  luminaire += TaskOf(sampling, tasks, pixel).light;
  const float4 position = positions[pixel];
  const float3 p = MakeReceiver(luminaire, position.xyz, (float3)(0.0f)).p;
  const bool lit = position.w != 0.0f && p.z > 0.0f;
  __constant const AxisParams* params = &luminaire->axis[dimension];
  const Axis axis = MakeAxis(params, luminaire->delta, dimension ? p.y : p.x, lit ? p.z : 1.0f);
  __global int4* span =
      spans + (size_t)(dimension ? luminaire->axis[0].count : 0) * sampling->scratch_stride + item;
  for (int i = 0; i < params->count; ++i, span += sampling->scratch_stride)
    *span = lit ? PackSpan(MakeSpan(&axis, i, luminaire->basis.cells, params->texels)) : (int4)(0);
}

// Item (pixel, row of images): masses of the row's windows; what the pixel's shadow maps hide of an
// image (`seen`, may be null) does not count.
__kernel void WindowMasses(__constant const LuminaireParams* luminaire,
                           __constant const SamplingParams* sampling, TASK_ARGUMENTS,
                           __global const ulong* sat, __global const float* sat_scale,
                           __global const uint* seen, __global const int4* spans,
                           __global float* masses) {
  const int item = get_global_id(0), j = get_global_id(1);
  if (sampling->begin + item >= sampling->end) return;
  luminaire += TaskOf(sampling, tasks, sampling->begin + item).light;
  const int columns = luminaire->axis[0].count, stride = sampling->scratch_stride;
  const int width = SatStride(luminaire->axis[0].texels), height = luminaire->axis[1].texels + 1;
  __global const uint* seen_by_pixel = SeenByPixel(luminaire, seen, sampling->begin + item);
  const Span rows = UnpackSpan(spans[(size_t)(columns + j) * stride + item]);
  for (int i = 0, m = j * columns; i < columns; ++i, ++m) {
    const Span span = UnpackSpan(spans[(size_t)i * stride + item]);
    masses[(size_t)m * stride + item] =
        WindowMass(sat + (size_t)m * width * height, width, span, rows) * sat_scale[m] *
        ImageVisibility(luminaire, seen_by_pixel, i, j);
  }
}
