#include "luxfield/render/significant_lights.h"

#include <algorithm>

namespace luxfield::render {
namespace {

constexpr char kPath[] = "kernels/lights/significant_lights.cl";

}  // namespace

SignificantLights::SignificantLights(const Device& device, std::span<const BoundedLight> lights,
                                     std::span<const BoundedTable> tables)
    : device_(device),
      count_(lights.size()),
      tree_(UploadLightTree(device, lights, tables)),
      count_kernel_(Program::Build(device, kPath), "CountSignificant"),
      find_kernel_(Program::Build(device, kPath), "FindSignificantLights") {}

std::vector<std::vector<std::size_t>> SignificantLights::PointsOf(const GBuffer& gbuffer,
                                                                  double share) {
  const std::size_t points = gbuffer.pixel_count();
  const auto of_all = static_cast<cl_int>(points);
  Buffer device_counts(device_, points * sizeof(cl_int));
  count_kernel_
      .Set(tree_.nodes, tree_.lights, tree_.tables, static_cast<cl_float>(share), of_all,
           gbuffer.position, gbuffer.normal, device_counts)
      .Enqueue(points);
  auto counts = device_counts.Download<cl_int>();
  std::vector<cl_int> starts(points);
  std::size_t sum = 0;
  for (std::size_t k = 0; k < points; ++k) {
    starts[k] = static_cast<cl_int>(sum);
    sum += counts[k];
  }
  std::vector<std::vector<std::size_t>> points_of(count_);
  if (sum == 0) return points_of;
  Buffer device_found(device_, sum * sizeof(cl_int));
  find_kernel_
      .Set(tree_.nodes, tree_.lights, tree_.tables, static_cast<cl_float>(share), of_all,
           gbuffer.position, gbuffer.normal, Buffer::From(device_, starts), device_found)
      .Enqueue(points);
  const auto found = device_found.Download<cl_int>();
  for (std::size_t k = 0; k < points; ++k)
    for (int i = 0; i < counts[k]; ++i) points_of[found[starts[k] + i]].push_back(k);
  return points_of;
}

}  // namespace luxfield::render
