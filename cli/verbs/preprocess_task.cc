#include "luxfield/cli/verbs/preprocess_task.h"

#include "luxfield/core/parallel.h"
#include "luxfield/lightfield/light_field_file.h"
#include "luxfield/preprocess/table_files.h"
#include "luxfield/shard/join_exr.h"

namespace luxfield::cli {
namespace {

using core::Field;
using preprocess::MedianPoint;

preprocess::TableSource SourceOf(const std::filesystem::path& light_field,
                                 const core::Json& whole) {
  const auto hashes = Field<std::vector<std::string>>(whole, "inputs_sha256", "job.json");
  return {light_field, light_field.string(), hashes.at(0), core::Threads()};
}

}  // namespace

int PreprocessTask::Length() const {
  return lightfield::LightFieldFile(light_field_).only().geometry.grid.count();
}

core::Json PreprocessTask::Run(const core::Json& whole, int first, int last,
                               std::span<const std::filesystem::path> files) const {
  core::Json points = core::Json::array();
  for (const MedianPoint& point :
       preprocess::WriteTableImages(SourceOf(light_field_, whole), files[0], first, last))
    points.push_back({{"lit", point.lit}, {"s_m", point.s_m}, {"t_m", point.t_m}});
  return {{"medians", points}};
}

void PreprocessTask::Join(const core::Json& whole, std::span<const shard::Piece> pieces) const {
  std::vector<std::filesystem::path> files;
  std::vector<MedianPoint> points;
  for (const shard::Piece& piece : pieces) {
    files.push_back(piece.files[0]);
    const std::string file = piece.files[0].string();
    for (const auto& point : Field<std::vector<core::Json>>(piece.figures, "medians", file))
      points.push_back({Field<bool>(point, "lit", file), Field<double>(point, "s_m", file),
                        Field<double>(point, "t_m", file)});
  }
  const auto reference = preprocess::TableReferenceOf(SourceOf(light_field_, whole), points);
  const core::ExrPartView behind = reference.view();
  shard::JoinExrParts(files, output_, core::ExrCompression::kNone, std::span(&behind, 1));
}

}  // namespace luxfield::cli
