#include "luxfield/render/column_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <span>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/progress.h"
#include "luxfield/lightfield/light_field_file.h"
#include "luxfield/render/estimators/volume.h"

namespace luxfield::render {
namespace {

using lightfield::ColumnGroup;
using lightfield::LuminaireGeometry;

constexpr std::uint64_t kMib = 1 << 20;
// A frame has 17 values a pixel, and so has the sum of frames.
constexpr std::uint64_t kPixelBytes = 2 * 17 * sizeof(float);
// What is resident of a band while it is lit, and what files and drivers take besides.
constexpr std::uint64_t kBesideBytes = 48 * kMib;
constexpr std::uint64_t kLargestTable = preprocess::VolumeOptions{}.max_bytes;
constexpr std::uint64_t kSmallestTable = kMib / 16;
// Of the points that a table is made for, of each luminaire: all of them, those that see images,
// and numbers of these by their height.
constexpr std::uint64_t kReceiverBytes =
    3 * sizeof(preprocess::Receiver) * LitScene::kVolumePixels * LitScene::kVolumePixels;

void RefuseWhole(const scene::Scene& scene, const RenderOptions& options) {
  const bool exact = options.estimator == "exact", volume = options.estimator == "volume",
             none = options.shadows == Shadows::kNone,
             maps = exact && options.shadows == Shadows::kMaps;
  if ((!exact && !volume) || (!none && !maps) || options.knobs.strategies.everywhere)
    throw InputError(fmt::format(
        "--memory lights by --estimator exact or volume with --shadows none, or by exact with "
        "--shadows maps: {} with shadows '{}' takes light fields as a whole; choose one of these, "
        "or leave --memory out",
        options.knobs.strategies.everywhere ? "--knob strategies-for" : options.estimator,
        ShadowsName(options.shadows)));
  if (options.light_groups)
    throw InputError(
        "--memory makes one picture of all lights and no --light-groups; leave one of them out");
  if (scene.luminaires.empty())
    throw InputError(scene.file.string(), "holds no light field, and --memory is for large ones",
                     "leave --memory out");
  const char* other = scene.environment                 ? "an environment"
                      : !scene.area_lights.empty()      ? "area lights"
                      : !scene.classical_lights.empty() ? "lights of photometric files"
                                                        : nullptr;
  const auto& materials = scene.geometry.materials;
  if (!other && std::ranges::any_of(materials, scene::IsEmissive)) other = "surfaces that shine";
  if (other)
    throw InputError(scene.file.string(),
                     fmt::format("has {}, and --memory lights by light fields alone", other),
                     "take them out, or leave --memory out");
}

std::uint64_t ColumnBytes(const LuminaireGeometry& geometry) {
  return geometry.grid.height * LuminaireOnDevice::ImageBytes(geometry);
}

// While a table of so many bytes is built, measured and lights with groups of one column.
std::uint64_t BytesWithTable(std::uint64_t table, std::uint64_t group) {
  return std::max(5 * table / 2, 2 * table + group);
}

// 2^-k of the largest table, so that one that is kept is found again whatever is free.
std::uint64_t TableWithin(std::uint64_t bytes, std::uint64_t group) {
  std::uint64_t table = kLargestTable;
  while (table > kSmallestTable && BytesWithTable(table, group) > bytes) table /= 2;
  return table;
}

std::uint64_t TableOf(std::uint64_t wanted) {
  std::uint64_t table = kSmallestTable;
  while (table < wanted) table *= 2;
  return table;
}

std::string MoreMemory(std::uint64_t needed, std::uint64_t left) {
  return fmt::format("give it {} MiB more", (needed - left) / kMib + 1);
}

void AddLight(const Frame& more, Frame& sum) {
  if (sum.radiance.data.empty()) {
    sum = more;
    return;
  }
  for (const auto image : {&Frame::radiance, &Frame::irradiance})
    for (std::size_t k = 0; k < (sum.*image).data.size(); ++k)
      (sum.*image).data[k] += (more.*image).data[k];
  AddTimes(more.times, sum.times);
}

}  // namespace

void ColumnPicture::Table::Add(std::span<const cl_float4> more) {
  lit.resize(more.size());
  for (std::size_t k = 0; k < more.size(); ++k)
    for (int c = 0; c < 4; ++c) lit[k].s[c] += more[k].s[c];
}

ColumnPicture::ColumnPicture(const Device& device, scene::Scene scene, const RenderOptions& options,
                             int most_columns)
    : device_(device),
      options_((RefuseWhole(scene, options), options)),
      most_columns_(most_columns),
      lit_([&] {
        LoadHeaders(scene.luminaires);
        scene.luminaires.clear();
        return LitScene(device, std::move(scene));
      }()) {
  options_.relight = false;  // there is no noise to measure
  Warm();
}

void ColumnPicture::LoadHeaders(const std::vector<scene::Luminaire>& luminaires) {
  std::map<std::filesystem::path, std::size_t> first_of;  // field of each file
  for (std::size_t number = 0; number < luminaires.size(); ++number) {
    const scene::Luminaire& luminaire = luminaires[number];
    const auto [at, is_new] = first_of.emplace(luminaire.light_field, fields_.size());
    if (is_new) {
      const auto file = std::make_shared<lightfield::LightFieldFile>(luminaire.light_field);
      const std::string sha256 = core::Sha256OfFile(luminaire.light_field);
      for (std::size_t k = 0; k < file->fields().size(); ++k)
        fields_.push_back({luminaire.light_field, sha256, file, k, {}});
    }
    Field* field = &fields_[at->second];
    provenance_[fmt::format("{} sha256", luminaire.name)] = field->sha256;
    for (std::size_t k = 0; k < field->file->fields().size(); ++k)
      field[k].luminaires.push_back(PlaceField(luminaire, number, field[k].field(), nullptr));
  }
}

void ColumnPicture::Warm() {
  lightfield::LightField small;
  small.geometry = fields_.front().geometry();
  small.geometry.grid.width = small.geometry.grid.height = 1;
  small.geometry.lattice.width = small.geometry.lattice.height = 4;
  small.data.resize(small.geometry.value_count());
  preprocess::LightVectorVolume empty;
  empty.geometry = small.geometry;
  LuminaireOnDevice on_device(device_, small, {.volume = by_volume() ? &empty : nullptr});
  PlacedLuminaire luminaire = fields_.front().luminaires.front();
  luminaire.light_field =
      std::make_shared<LoadedLightField>(LoadedLightField{fields_.front().path,
                                                          {},
                                                          {},
                                                          {},
                                                          std::move(on_device),
                                                          {},
                                                          {},
                                                          options_.approximation_error});
  RenderOptions options = options_;
  options.width = 64;
  options.height = 48;
  lit_.ReplaceLuminaires({luminaire});
  Renderer(lit_, options).Render();
  lit_.ReplaceLuminaires({});
}

std::uint64_t ColumnPicture::PictureBytes() const {
  const scene::Camera& camera = lit_.camera();
  const auto width = options_.width > 0 ? options_.width : camera.width,
             height = options_.height > 0 ? options_.height : camera.height;
  return static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) * kPixelBytes +
         kBesideBytes;
}

std::uint64_t ColumnPicture::GroupBytes(const Field& field, int columns) const {
  const LuminaireGeometry group = ColumnGroup{0, columns}.GeometryIn(field.geometry());
  const std::uint64_t image = LuminaireOnDevice::ImageBytes(group);
  std::uint64_t bytes = (static_cast<std::uint64_t>(group.grid.count()) + 2) * image;
  if (options_.shadows == Shadows::kMaps) {
    const auto cells = static_cast<std::uint64_t>(ShadowMaps::CellCount(group.grid));
    bytes += ShadowMaps::Bytes(group.grid, options_.ShadowMapSize()) +
             (cells / 32 + 1) * sizeof(cl_uint) * Renderer::kBandPixels;
  }
  return bytes;
}

int ColumnPicture::ColumnsWithin(const Field& field, std::uint64_t bytes) const {
  const LuminaireGeometry& g = field.geometry();
  int columns = 0;
  while (columns < std::min(g.grid.width, most_columns_) &&
         GroupBytes(field, columns + 1) <= bytes &&
         static_cast<std::uint64_t>(columns + 1) * ColumnBytes(g) <=
             device_.info().max_allocation_bytes)
    ++columns;
  if (columns > 0) return columns;
  const std::uint64_t column = GroupBytes(field, 1);
  throw InputError(
      field.path.string(),
      fmt::format("one column of it, {} images of {} x {} texels, takes {} MiB beside the picture, "
                  "and --memory leaves {}",
                  g.grid.height, g.lattice.width, g.lattice.height, column / kMib + 1,
                  bytes / kMib),
      MoreMemory(std::max(column, bytes), bytes));
}

ColumnPicture::Table ColumnPicture::MakeTable(const Field& field, std::uint64_t bytes) {
  if (!by_volume()) return {};
  bytes -= std::min(bytes, kReceiverBytes * field.luminaires.size());
  const std::uint64_t column = GroupBytes(field, 1);
  const std::uint64_t most = TableWithin(bytes, column);
  if (BytesWithTable(most, column) > bytes)
    throw InputError(field.path.string(),
                     "its light-vector volume does not fit beside the picture and one column of it",
                     MoreMemory(BytesWithTable(most, column), bytes));
  const int at_once = ColumnsWithin(field, bytes - 3 * most / 2);
  Table table{
      preprocess::KeptVolume(lightfield::FieldColumns(*field.file, field.number, at_once),
                             OriginOf(field.path, field.sha256, field.field().name),
                             lit_.SeenReceivers(field.luminaires),
                             {.max_rel_error = options_.approximation_error, .max_bytes = most}),
      {}};
  const std::uint64_t wanted = table.made.wanted_bytes;
  if (wanted > 0 && wanted <= kLargestTable)
    throw InputError(
        field.path.string(),
        fmt::format("its light-vector volume takes {} MiB for the error asked for, and --memory "
                    "leaves room for one of {}",
                    wanted / kMib + 1, most / kMib),
        MoreMemory(BytesWithTable(TableOf(wanted), column), bytes) +
            ", or use the estimator 'exact'");
  if (!table.made.met) RefuseVolume(field.path);
  return table;
}

void ColumnPicture::AddField(const Field& field, std::uint64_t bytes, Frame& sum) {
  Table table = MakeTable(field, bytes);
  const int at_once = ColumnsWithin(field, bytes - 2 * table.made.volume.bytes());
  core::Progress progress("render", lightfield::GroupsOf(field.geometry(), at_once).size());
  for (const ColumnGroup& group : lightfield::GroupsOf(field.geometry(), at_once)) {
    AddGroup(field, group, table, sum);
    progress.Advance();
  }
  if (by_volume())
    provenance_[fmt::format("{} volume error", field.luminaires.front().name)] = fmt::format(
        "{:.2g}", std::max(table.made.rel_error, RelativeRmse(table.made.judges, table.lit)));
}

void ColumnPicture::AddGroup(const Field& field, const ColumnGroup& group, Table& table,
                             Frame& sum) {
  const LuminaireGeometry& whole = field.geometry();
  LuminaireOnDevice on_device(
      device_, group.GeometryIn(whole), [&](int m, std::span<float> planes) {
        field.file->ReadImage(field.number, group.ImageIn(whole, m), planes);
      });
  if (by_volume()) {
    on_device.Add(device_, {.volume = &table.made.volume});
    table.made.volume.coefficients = {};  // the first group has it
    table.Add(LightReceivers(device_, lit_.EstimatorNamed("volume"), on_device, table.made.judges,
                             options_.approximation_error));
  }
  const auto loaded = std::make_shared<LoadedLightField>(
      LoadedLightField{field.path,
                       {},
                       field.sha256,
                       field.field().name,
                       std::move(on_device),
                       {},
                       {},
                       by_volume() ? options_.approximation_error : 0});
  for (PlacedLuminaire luminaire : field.luminaires) {
    luminaire.light_field = loaded;
    lit_.ReplaceLuminaires({luminaire});
    AddLight(Renderer(lit_, options_).Render(), sum);
  }
  lit_.ReplaceLuminaires({});
}

Frame ColumnPicture::Render(std::uint64_t bytes) {
  const std::uint64_t picture = PictureBytes();
  if (picture > bytes)
    throw InputError(fmt::format("the picture alone takes {} MiB, and --memory leaves {}; {}",
                                 picture / kMib, bytes / kMib, MoreMemory(picture, bytes)));
  Frame sum;
  for (const Field& field : fields_) AddField(field, bytes - picture, sum);
  for (const auto& [name, value] : provenance_) sum.provenance[name] = value;
  return sum;
}

}  // namespace luxfield::render
