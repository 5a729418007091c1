#include "luxfield/render/lights/environment_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "luxfield/core/error.h"
#include "luxfield/render/kernels/environment/environment_types.clh"

namespace luxfield::render {
namespace {

constexpr char kTables[] = "kernels/environment/environment_tables.cl";

int Checked(int face_size, const EnvironmentTableOptions& options) {
  constexpr int kMaxFace = 18918;  // 6 N^2 < 2^31
  if (face_size < 1 || face_size > kMaxFace)
    throw InputError(
        fmt::format("environment map: a face of {} texels along a side must have 1 to {}",
                    face_size, kMaxFace));
  options.Validate(face_size);
  return face_size;
}

}  // namespace

void EnvironmentTableOptions::Validate(int face_size) const {
  if (tiles_per_side < 1 || tiles_per_side > kMaxTiles || face_size % tiles_per_side != 0)
    throw InputError(fmt::format(
        "environment map: {} tiles along a face of {} texels; choose 1 to {}, a divisor "
        "of its texels",
        tiles_per_side, face_size, kMaxTiles));
  if (!(compensation >= 0 && compensation <= 1))
    throw InputError(
        fmt::format("environment map: compensation = {} must lie in [0, 1]", compensation));
}

EnvironmentLight::EnvironmentLight(const Device& device, int face_size,
                                   const EnvironmentTableOptions& options)
    : device_(device),
      face_size_(Checked(face_size, options)),
      options_(options),
      rows_(Program::Build(device, kTables), "EnvironmentRows"),
      total_(Program::Build(device, kTables), "EnvironmentTotal"),
      conditional_(Program::Build(device, kTables), "EnvironmentConditional"),
      marginal_(Program::Build(device, kTables), "EnvironmentMarginal") {
  const std::size_t face = static_cast<std::size_t>(face_size) * face_size;
  const std::vector<double> angles = environment::TexelSolidAngles(face_size);
  solid_angles_ = Buffer::From(device, std::vector<float>(angles.begin(), angles.end()));
  radiance_ = Buffer(device, 18 * face * sizeof(float));
  radiance_.FillZero();
  texels_ = Buffer(device, 6 * face * sizeof(cl_float4));
  column_starts_ = Buffer(device, 6 * face * sizeof(cl_ulong));
  totals_ = Buffer(device, sizeof(EnvironmentTotals));
  PlaceTiles();
  MakeTables();
}

void EnvironmentLight::PlaceTiles() {
  const int side = options_.tiles_per_side;
  row_sums_ = Buffer(device_, row_count() * sizeof(float));
  row_starts_ = Buffer(device_, (row_count() + std::size_t{1}) * sizeof(cl_ulong));
  energies_ = Buffer(device_, tile_count() * sizeof(float));
  std::vector<cl_float4> corners;
  for (int face = 0; face < 6; ++face)
    for (int row = 0; row < side; ++row)
      for (int column = 0; column < side; ++column)
        for (int corner = 0; corner < 4; ++corner) {
          const double x = -1 + 2.0 * (column + corner % 2) / side,
                       y = 1 - 2.0 * (row + corner / 2) / side;
          const auto v = Normalized(environment::CubeVector({face, x, y}));
          corners.push_back(
              {{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), 0}});
        }
  corners_ = Buffer::From(device_, corners);
  UploadParams();
}

void EnvironmentLight::UploadParams() {
  EnvironmentParams params{};
  params.face_size = face_size_;
  params.tiles_per_side = options_.tiles_per_side;
  params.tile_size = face_size_ / options_.tiles_per_side;
  params.compensation = options_.compensation;
  // The inverse of a rotation is its transpose.
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      params.rotation[3 * row + column] =
          static_cast<float>(world_from_environment_.linear[column][row]);
  params_ = Buffer::From(device_, std::span<const EnvironmentParams>(&params, 1));
}

void EnvironmentLight::Show(const environment::CubeMap& frame) {
  if (frame.face_size != face_size_)
    throw InputError(
        fmt::format("environment map: a frame of {} texels along a face where {} are "
                    "expected; give all frames one size",
                    frame.face_size, face_size_));
  for (const float value : frame.data)
    if (!(value >= 0 && value <= kMaxRadiance))
      throw InputError(
          fmt::format("environment map: radiance {} must lie in [0, {:g}]", value, kMaxRadiance));
  radiance_.Upload(std::span<const float>(frame.data));
  MakeTables();
}

void EnvironmentLight::SetOptions(const EnvironmentTableOptions& options) {
  if (options == options_) return;
  options.Validate(face_size_);
  options_ = options;
  PlaceTiles();
  MakeTables();
}

void EnvironmentLight::SetPose(const scene::Pose& world_from_environment) {
  world_from_environment_ = world_from_environment;
  UploadParams();
}

void EnvironmentLight::MakeTables() {
  const auto rows = static_cast<std::size_t>(row_count());
  rows_.Set(params_, radiance_, solid_angles_, texels_, row_sums_)
      .Enqueue({rows * kRowItems}, {kRowItems});
  total_.Set(row_sums_, static_cast<cl_int>(rows), totals_).Enqueue({kTotalItems}, {kTotalItems});
  conditional_.Set(params_, totals_, solid_angles_, texels_, column_starts_, row_starts_)
      .Enqueue({rows * kRowItems}, {kRowItems});
  marginal_.Set(params_, row_starts_, energies_).Enqueue({kTotalItems}, {kTotalItems});
}

}  // namespace luxfield::render
