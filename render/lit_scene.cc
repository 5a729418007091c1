#include "render/lit_scene.h"

#include <fmt/format.h>

#include "core/error.h"
#include "core/file.h"
#include "core/stopwatch.h"
#include "preprocess/table_io.h"

namespace luxfield::render {
namespace {

// The tables given, else X.tab.exr beside X.lf.exr if it exists, else empty.
std::filesystem::path TablesOf(const scene::Luminaire& luminaire) {
  if (!luminaire.tables.empty()) return luminaire.tables;
  auto path = luminaire.light_field;
  path.replace_extension();
  if (path.extension() == ".lf") path.replace_extension();
  path += ".tab.exr";
  return std::filesystem::exists(path) ? path : std::filesystem::path();
}

preprocess::Tables ReadOrBuildTables(const LoadedLightField& light_field) {
  if (light_field.tables_file.empty())
    return preprocess::BuildTables(light_field.field, light_field.file.string(),
                                   light_field.sha256);
  const auto tables = preprocess::ReadTables(light_field.tables_file);
  preprocess::CheckTables(tables, light_field.tables_file.string(), light_field.field.geometry,
                          light_field.sha256);
  return tables;
}

}  // namespace

LitScene::LitScene(const Device& device, const scene::Scene& scene)
    : device_(device), camera_(scene.camera), geometry_(UploadScene(device, scene.geometry)) {
  if (!scene.file.empty()) provenance_["scene_sha256"] = core::Sha256OfFile(scene.file);
  std::map<std::pair<std::filesystem::path, std::filesystem::path>,
           std::shared_ptr<LoadedLightField>>
      loaded;
  for (const auto& luminaire : scene.luminaires) {
    auto& light_field = loaded[{luminaire.light_field, luminaire.tables}];
    if (!light_field) light_field = Load(luminaire);
    luminaires_.push_back(
        {luminaire.name, light_field, luminaire.world_from_luminaire, luminaire.scale});
    provenance_[fmt::format("{} sha256", luminaire.name)] = light_field->sha256;
  }
}

std::shared_ptr<LoadedLightField> LitScene::Load(const scene::Luminaire& luminaire) {
  auto field = lightfield::ReadLightField(luminaire.light_field);
  const auto unit = field.geometry.unit;
  if (!luminaires_.empty() && unit != unit_)
    throw InputError(luminaire.light_field.string(),
                     fmt::format("its unit is {}, that of the luminaires before it {}",
                                 FluxUnitName(unit), FluxUnitName(unit_)),
                     "light a scene with luminaires of one unit");
  unit_ = unit;
  LuminaireOnDevice on_device(device_, field);
  return std::make_shared<LoadedLightField>(LoadedLightField{
      luminaire.light_field, TablesOf(luminaire), core::Sha256OfFile(luminaire.light_field),
      std::move(field), std::move(on_device)});
}

Estimator& LitScene::EstimatorNamed(const std::string& name) {
  auto& estimator = estimators_[name];
  if (!estimator) estimator = MakeEstimator(name, device_);
  return *estimator;
}

void LitScene::Require(const TableNeeds& needs) {
  const core::Stopwatch stopwatch;
  for (const auto& luminaire : luminaires_) {
    LoadedLightField& light_field = *luminaire.light_field;
    if (needs.sat && !light_field.on_device.has_sat()) {
      const preprocess::Tables tables = ReadOrBuildTables(light_field);
      light_field.on_device.Add(device_, {.sat = &tables});
    }
  }
  tables_core_s_ += stopwatch.CoreSeconds();
}

}  // namespace luxfield::render
