#include "luxfield/bench/device_limits.h"

#include <algorithm>
#include <vector>

#include "luxfield/core/stopwatch.h"
#include "luxfield/lightfield/projected_texels.h"

namespace luxfield::bench {
namespace {

constexpr int kRuns = 7;

// Sixteen sums that do not wait for each other, so that every multiply-add unit is busy.
constexpr int kSums = 16, kLanes = 16, kRounds = 4096;
constexpr const char* kMultiplyAdds = R"(
__kernel void MultiplyAdds(float a, float b, int rounds, __global float* out) {
  float16 sum[16];
  for (int k = 0; k < 16; ++k) sum[k] = (float16)((float)(get_global_id(0) + k));
  const float16 x = a, y = b;
  for (int round = 0; round < rounds; ++round) {
#pragma unroll
    for (int k = 0; k < 16; ++k) sum[k] = fma(sum[k], x, y);
  }
  float16 all = 0.0f;
  for (int k = 0; k < 16; ++k) all += sum[k];
  vstore16(all, get_global_id(0), out);
})";

// Sixteen pixels an item, as the volume's kernel takes them.
constexpr std::size_t kPixelsPerItem = 16;
constexpr const char* kPass = R"(
__kernel void Pass(__global const float* position, __global const float* normal,
                   __global float* irradiance, int pixels) {
  const int first = 16 * get_global_id(0);
  for (int k = first; k < min(first + 16, pixels); k += 4) {
    if (k + 4 > pixels) {
      for (int each = 4 * k; each < 4 * pixels; ++each)
        irradiance[each] += position[each] + normal[each];
      continue;
    }
    __global float* to = irradiance + 4 * k;
    vstore16(vload16(0, to) + (vload16(0, position + 4 * k) + vload16(0, normal + 4 * k)), 0, to);
  }
})";

double Seconds(const render::Device& device, const core::Stopwatch& stopwatch) {
  return device.info().is_cpu ? stopwatch.CoreSeconds() : stopwatch.WallSeconds();
}

// Texels of one axis that all supports see from a receiver, each counted as often as it is seen.
double SeenTexels(const lightfield::LuminaireGeometry& g, int dimension, double p_m, double z_m) {
  const auto texels = dimension == 0 ? lightfield::TexelAxis::Columns(g.lattice)
                                     : lightfield::TexelAxis::Rows(g.lattice);
  double seen = 0;
  for (const auto& run : lightfield::ProjectAllTexels(
           g.grid.basis, dimension == 0 ? g.grid.u0_m : g.grid.v0_m, g.grid.spacing_m,
           dimension == 0 ? g.grid.width : g.grid.height, texels,
           lightfield::PencilAxis::ThroughPoint(p_m, z_m, g.delta_m)))
    seen += static_cast<double>(run.size());
  return seen;
}

}  // namespace

double ExactMultiplyAdds(const lightfield::LightField& field, const render::GBuffer& gbuffer,
                         std::size_t sample) {
  const auto position = gbuffer.position.Download<cl_float4>();
  const std::size_t step =
      std::max<std::size_t>(1, position.size() / std::max<std::size_t>(1, sample));
  double pairs = 0;
  std::size_t looked_at = 0;
  for (std::size_t k = 0; k < position.size(); k += step, ++looked_at) {
    const auto& p = position[k].s;
    if (p[3] == 0 || !(p[2] > 0)) continue;
    pairs += SeenTexels(field.geometry, 0, p[0], p[2]) * SeenTexels(field.geometry, 1, p[1], p[2]);
  }
  if (looked_at == 0) return 0;
  return 2 * pairs / static_cast<double>(looked_at) * static_cast<double>(position.size());
}

double MultiplyAddsPerSecond(const render::Device& device) {
  const std::size_t items = 4096;
  const auto program = render::Program::BuildText(device, kMultiplyAdds, "multiply_adds");
  render::Kernel kernel(program, "MultiplyAdds");
  const render::Buffer out(device, items * kLanes * sizeof(cl_float));
  kernel.Set(cl_float{0.999f}, cl_float{0.001f}, cl_int{kRounds}, out);
  double best = 0;
  for (int run = 0; run <= kRuns; ++run) {
    const core::Stopwatch stopwatch;
    kernel.Enqueue(items);
    device.Finish();
    const double rate =
        static_cast<double>(items) * kSums * kLanes * kRounds / Seconds(device, stopwatch);
    if (run > 0) best = std::max(best, rate);  // the first one compiles
  }
  return best;
}

double GBufferPassSeconds(const render::Device& device, const render::GBuffer& gbuffer) {
  const auto program = render::Program::BuildText(device, kPass, "gbuffer_pass");
  render::Kernel kernel(program, "Pass");
  render::Buffer irradiance(device, gbuffer.pixel_count() * sizeof(cl_float4));
  irradiance.FillZero();
  kernel.Set(gbuffer.position, gbuffer.normal, irradiance,
             static_cast<cl_int>(gbuffer.pixel_count()));
  std::vector<double> seconds;
  for (int run = 0; run <= kRuns; ++run) {
    const core::Stopwatch stopwatch;
    kernel.Enqueue((gbuffer.pixel_count() + kPixelsPerItem - 1) / kPixelsPerItem);
    device.Finish();
    if (run > 0) seconds.push_back(Seconds(device, stopwatch));
  }
  return core::Median(seconds);
}

}  // namespace luxfield::bench
