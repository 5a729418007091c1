#include "luxfield/render/lit_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/stopwatch.h"
#include "luxfield/environment/kept_cube_map.h"
#include "luxfield/formats/far_field.h"
#include "luxfield/formats/photometric_file.h"
#include "luxfield/preprocess/table_io.h"
#include "luxfield/render/estimators/volume.h"

namespace luxfield::render {
namespace {

bool StandsAt(const scene::Pose& a, const scene::Pose& b) {
  return a.linear == b.linear && a.translation.x == b.translation.x &&
         a.translation.y == b.translation.y && a.translation.z == b.translation.z;
}

// The tables given, else X.tab.exr beside X.lf.exr if it exists, else empty.
std::filesystem::path TablesOf(const scene::Luminaire& luminaire) {
  if (!luminaire.tables.empty()) return luminaire.tables;
  auto path = luminaire.light_field;
  path.replace_extension();
  if (path.extension() == ".lf") path.replace_extension();
  path += ".tab.exr";
  return std::filesystem::exists(path) ? path : std::filesystem::path();
}

scene::Pose ToPose(const lightfield::RigidPose& rigid) {
  scene::Pose pose;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      pose.linear[row][column] = rigid.rotation[3 * row + column];
  pose.translation = rigid.translation_m;
  return pose;
}

preprocess::FieldOrigin OriginOf(const LoadedLightField& light_field) {
  return render::OriginOf(light_field.file, light_field.sha256, light_field.part);
}

preprocess::Tables ReadOrBuildTables(const LoadedLightField& light_field) {
  if (light_field.tables_file.empty())
    return preprocess::KeptTables([&] { return light_field.on_device.Download(); },
                                  OriginOf(light_field));
  const auto tables = preprocess::ReadTables(light_field.tables_file);
  preprocess::CheckTables(tables, light_field.tables_file.string(), light_field.geometry(),
                          light_field.sha256);
  return tables;
}

}  // namespace

preprocess::FieldOrigin OriginOf(const std::filesystem::path& file, const std::string& sha256,
                                 const std::string& part) {
  return {file.string(), sha256 + (part.empty() ? "" : " " + part)};
}

PlacedLuminaire PlaceField(const scene::Luminaire& luminaire, std::size_t number,
                           const lightfield::LightFieldFile::Field& field,
                           std::shared_ptr<LoadedLightField> light_field) {
  const scene::Pose luminaire_from_field = ToPose(field.luminaire_from_field);
  return {field.name.empty() ? luminaire.name : fmt::format("{} {}", luminaire.name, field.name),
          std::move(light_field),
          luminaire.world_from_luminaire * luminaire_from_field,
          scene::ChannelScale(luminaire.scale, luminaire.colour),
          number,
          luminaire_from_field};
}

void RefuseVolume(const std::filesystem::path& light_field) {
  throw InputError(light_field.string(),
                   "a light-vector volume of its light in this scene takes more than 256 MiB",
                   "use the estimator 'exact'");
}

LitScene::LitScene(const Device& device, const scene::Scene& scene)
    : LitScene(device, scene, UploadScene(device, scene.geometry)) {}

LitScene::LitScene(const Device& device, scene::Scene&& scene)
    : LitScene(device, scene, UploadScene(device, std::move(scene.geometry))) {}

LitScene::LitScene(const Device& device, const scene::Scene& scene, DeviceScene geometry)
    : device_(device), camera_(scene.camera), geometry_(std::move(geometry)), mis_(device) {
  if (!scene.file.empty()) provenance_["scene_sha256"] = core::Sha256OfFile(scene.file);
  for (const auto& light : scene.area_lights) area_lights_.push_back(MakeAreaLight(light));
  if (scene.environment) LoadEnvironment(*scene.environment);
  std::map<std::pair<std::filesystem::path, std::filesystem::path>, std::vector<LoadedField>>
      loaded;
  for (std::size_t number = 0; number < scene.luminaires.size(); ++number) {
    const scene::Luminaire& luminaire = scene.luminaires[number];
    auto& fields = loaded[{luminaire.light_field, luminaire.tables}];
    if (fields.empty()) fields = Load(luminaire);
    for (const LoadedField& field : fields) {
      luminaires_.push_back(PlaceField(luminaire, number, field.field, field.light_field));
      light_names_.push_back(luminaire.name);
    }
    provenance_[fmt::format("{} sha256", luminaire.name)] = fields.front().light_field->sha256;
  }
  for (const auto& light : scene.area_lights) light_names_.push_back(light.name);
  LoadClassicalLights(scene.classical_lights);
  if (environment_) light_names_.push_back("environment");
}

void LitScene::LoadClassicalLights(const std::vector<scene::ClassicalLight>& lights) {
  std::map<std::filesystem::path, std::shared_ptr<const Distribution>> loaded;
  for (const scene::ClassicalLight& light : lights) {
    auto& distribution = loaded[light.distribution];
    if (!distribution) {
      formats::Photometry photometry = formats::ReadPhotometry(light.distribution);
      TakeUnit(formats::FluxUnitOf(photometry), light.distribution);
      distribution = std::make_shared<const Distribution>(device_, std::move(photometry));
    }
    std::string& sha256 = provenance_[fmt::format("{} sha256", light.name)];
    if (sha256.empty()) sha256 = core::Sha256OfFile(light.distribution);
    classical_lights_.push_back(MakeClassicalLight(light, distribution));
    light_names_.push_back(light.name);
  }
}

void LitScene::TakeUnit(lightfield::FluxUnit unit, const std::filesystem::path& file) {
  if (unit_ && *unit_ != unit)
    throw InputError(file.string(),
                     fmt::format("its unit is {}, that of the luminaires before it {}",
                                 FluxUnitName(unit), FluxUnitName(*unit_)),
                     "light a scene with luminaires of one unit");
  unit_ = unit;
}

void LitScene::LoadEnvironment(const scene::Environment& environment) {
  std::optional<environment::EnvironmentSequence> sequence;
  std::filesystem::path file = environment.file;
  environment::CubeMap map;
  if (environment::IsEnvironmentSequence(file)) {
    sequence.emplace(
        file, environment::EnvironmentSequenceOptions{environment.layout, environment.face_size});
    file = sequence->frames().front();
    sequence->Next(map);
  } else {
    map = environment::KeptCubeMap(file, environment.layout, environment.face_size);
  }
  environment_.emplace(PlacedEnvironment{EnvironmentLight(device_, map.face_size),
                                         environment.scale, std::move(sequence)});
  environment_->light.SetPose(environment.world_from_environment);
  ShowEnvironment(map, file);
}

void LitScene::ShowEnvironment(const environment::CubeMap& map, const std::filesystem::path& file) {
  environment_->light.Show(map);
  provenance_["environment file"] = file.filename().string();
  provenance_["environment sha256"] = core::Sha256OfFile(file);
}

std::size_t LitScene::frame_count() const {
  return environment_ && environment_->sequence ? environment_->sequence->frames().size() : 1;
}

bool LitScene::NextFrame() {
  environment::CubeMap map;
  if (!environment_ || !environment_->sequence || !environment_->sequence->Next(map)) return false;
  ++environment_->frame;
  ShowEnvironment(map, environment_->sequence->frames()[environment_->frame]);
  return true;
}

void LitScene::ShowFrame(std::size_t frame) {
  if (frame >= frame_count()) throw std::logic_error("there is no such frame");
  if (frame_count() == 1 || frame == environment_->frame) return;
  if (frame != environment_->frame + 1) environment_->sequence->Rewind(frame);
  environment_->frame = frame - 1;
  NextFrame();
}

void LitScene::PlaceLuminaire(std::size_t number, const scene::PlacedLamp& lamp) {
  for (PlacedLuminaire& luminaire : luminaires_) {
    if (luminaire.number != number) continue;
    luminaire.world_from_luminaire = lamp.world_from_luminaire * luminaire.luminaire_from_field;
    luminaire.scale = scene::ChannelScale(lamp.scale, lamp.colour);
  }
}

void LitScene::PlaceClassicalLight(std::size_t number, const scene::PlacedLamp& lamp) {
  ClassicalLightSource& light = classical_lights_.at(number);
  Place(lamp.world_from_luminaire, lamp.scale, light);
  light.colour = lamp.colour;
}

void LitScene::PlaceEnvironment(const scene::Pose& world_from_environment, double scale) {
  if (!environment_) return;
  environment_->light.SetPose(world_from_environment);
  environment_->scale = scale;
}

void LitScene::RequireEnvironment(const EnvironmentTableOptions& options) {
  const core::Stopwatch stopwatch;
  if (environment_) environment_->light.SetOptions(options);
  tables_core_s_ += stopwatch.CoreSeconds();
}

EnvironmentEstimator& LitScene::environment_estimator() {
  if (!environment_estimator_) environment_estimator_.emplace(device_);
  return *environment_estimator_;
}

Estimator& LitScene::EstimatorOf(const LightSource& source, const std::string& near_field,
                                 bool mis_everywhere) {
  if (mis_everywhere) return mis();
  if (std::holds_alternative<PosedLuminaire>(source)) return EstimatorNamed(near_field);
  using Environment = std::reference_wrapper<const EnvironmentLight>;
  if (std::holds_alternative<Environment>(source)) return environment_estimator();
  return mis();
}

std::vector<PlacedLight> LitScene::Lights() const {
  std::vector<PlacedLight> lights;
  for (const PlacedLuminaire& luminaire : luminaires_)
    lights.push_back(
        {PosedLuminaire{luminaire.light_field->on_device, luminaire.world_from_luminaire},
         luminaire.scale});
  for (const AreaLightSource& light : area_lights_) lights.push_back({light});
  for (const ClassicalLightSource& light : classical_lights_)
    lights.push_back({light, light.colour});
  if (environment_)
    lights.push_back({environment_->light, scene::ChannelScale(environment_->scale, {1, 1, 1})});
  return lights;
}

std::vector<LitScene::LoadedField> LitScene::Load(const scene::Luminaire& luminaire) {
  lightfield::LightFieldFile file(luminaire.light_field);
  const auto& fields = file.fields();
  TakeUnit(fields.front().geometry.unit, luminaire.light_field);
  const bool alone = fields.size() == 1 && fields.front().name.empty();
  if (!alone && !luminaire.tables.empty())
    throw InputError(luminaire.tables.string(),
                     fmt::format("tables belong to one light field where {} holds {}",
                                 luminaire.light_field.string(), fields.size()),
                     "name no tables: they are built while the scene is loaded");
  const std::string sha256 = core::Sha256OfFile(luminaire.light_field);
  std::vector<LoadedField> loaded;
  for (std::size_t k = 0; k < fields.size(); ++k) {
    LuminaireOnDevice on_device(device_, fields[k].geometry, [&](int m, std::span<float> planes) {
      file.ReadImage(k, m, planes);
    });
    loaded.push_back({fields[k], std::make_shared<LoadedLightField>(LoadedLightField{
                                     luminaire.light_field,
                                     alone ? TablesOf(luminaire) : std::filesystem::path(),
                                     sha256,
                                     fields[k].name,
                                     std::move(on_device),
                                     {},
                                     {},
                                     0})});
  }
  return loaded;
}

Estimator& LitScene::EstimatorNamed(const std::string& name) {
  auto& estimator = estimators_[name];
  if (!estimator) estimator = MakeEstimator(name, device_);
  return *estimator;
}

void LitScene::ReplaceLuminaires(std::vector<PlacedLuminaire> luminaires) {
  light_names_.erase(light_names_.begin(),
                     light_names_.begin() + static_cast<std::ptrdiff_t>(luminaires_.size()));
  soft_maps_.clear();
  luminaires_ = std::move(luminaires);
  for (std::size_t l = 0; l < luminaires_.size(); ++l) {
    TakeUnit(luminaires_[l].light_field->geometry().unit, luminaires_[l].light_field->file);
    light_names_.insert(light_names_.begin() + static_cast<std::ptrdiff_t>(l), luminaires_[l].name);
  }
}

// At a resolution that finds the reach: pixels between and beyond are the estimator's to light
// otherwise.
std::vector<preprocess::Receiver> LitScene::SeenReceivers(
    std::span<const PlacedLuminaire> luminaires) const {
  scene::Camera camera = camera_;
  const double shrink =
      std::min(1.0, double{kVolumePixels} / std::max(camera.width, camera.height));
  camera.width = std::max(1, static_cast<int>(shrink * camera.width));
  camera.height = std::max(1, static_cast<int>(shrink * camera.height));
  GBuffer gbuffer(device_, camera.width, camera.height);
  PrimaryVisibility(device_).Render(geometry_, camera, 0, {0.5, 0.5}, gbuffer);
  std::vector<preprocess::Receiver> receivers;
  for (const PlacedLuminaire& luminaire : luminaires) {
    const auto more = ReceiversOf(gbuffer, luminaire.world_from_luminaire);
    receivers.insert(receivers.end(), more.begin(), more.end());
  }
  return receivers;
}

preprocess::VolumeForError LitScene::BuildVolume(const LoadedLightField& light_field,
                                                 double max_rel_error) const {
  std::vector<PlacedLuminaire> showing;
  for (const PlacedLuminaire& luminaire : luminaires_)
    if (luminaire.light_field.get() == &light_field) showing.push_back(luminaire);
  std::optional<lightfield::LightField> whole;  // once it is asked for
  const lightfield::FieldColumns columns(light_field.geometry(), [&](const auto& visit) {
    if (!whole) whole = light_field.on_device.Download();
    visit(*whole, 0);
  });
  return preprocess::KeptVolume(columns, OriginOf(light_field), SeenReceivers(showing),
                                {.max_rel_error = max_rel_error});
}

void LitScene::RequireSoftMaps(int size) {
  Require({.patches = true});
  if (!soft_maps_.empty() && soft_maps_.front().shadows.size() != PatchShadows::RoundUp(size))
    soft_maps_.clear();
  for (std::size_t i = 0; i < luminaires_.size(); ++i) {
    const scene::Pose& pose = luminaires_[i].world_from_luminaire;
    if (i == soft_maps_.size()) {
      soft_maps_.push_back(
          {pose, {device_, luminaires_[i].light_field->on_device, pose, geometry_.bvh(), size}});
    } else if (PosedSoftMaps& maps = soft_maps_[i]; !StandsAt(maps.world_from_luminaire, pose)) {
      maps.shadows.Draw(pose, geometry_.bvh());
      maps.world_from_luminaire = pose;
    }
  }
}

void LitScene::DropVolumes() {
  for (auto& luminaire : luminaires_) luminaire.light_field->volume_error = 0;
}

void LitScene::RequireIntensities() {
  const core::Stopwatch stopwatch;
  for (const auto& luminaire : luminaires_) {
    LoadedLightField& light_field = *luminaire.light_field;
    if (!light_field.intensity)
      light_field.intensity = preprocess::BuildIntensityTable(light_field.on_device.Download(),
                                                              light_field.file.string());
  }
  tables_core_s_ += stopwatch.CoreSeconds();
}

void LitScene::Require(const TableNeeds& needs, double volume_error) {
  const core::Stopwatch stopwatch;
  for (const auto& luminaire : luminaires_) {
    LoadedLightField& light_field = *luminaire.light_field;
    if (needs.sat && !light_field.on_device.has_sat()) {
      const preprocess::Tables tables = ReadOrBuildTables(light_field);
      light_field.on_device.Add(device_, {.sat = &tables});
      light_field.reference = tables.reference;
    }
    if (needs.cells && !light_field.on_device.has_cells()) {
      const auto cells = preprocess::KeptCellTables(
          [&] { return light_field.on_device.Download(); }, OriginOf(light_field));
      light_field.on_device.Add(device_, {.cells = &cells});
    }
    if (needs.patches && !light_field.on_device.has_patches()) {
      const preprocess::PatchLight patches =
          preprocess::TabulatePatchLight(light_field.on_device.Download());
      light_field.on_device.Add(device_, {.patches = &patches});
    }
    if (needs.volume &&
        !(light_field.volume_error > 0 && light_field.volume_error <= volume_error)) {
      const preprocess::VolumeForError built = BuildVolume(light_field, volume_error);
      if (!built.met) RefuseVolume(light_field.file);
      light_field.on_device.Add(device_, {.volume = &built.volume});
      light_field.volume_error = volume_error;
      const auto lit = LightReceivers(device_, EstimatorNamed("volume"), light_field.on_device,
                                      built.judges, volume_error);
      provenance_[fmt::format("{} volume error", luminaire.name)] =
          fmt::format("{:.2g}", std::max(built.rel_error, RelativeRmse(built.judges, lit)));
    }
  }
  tables_core_s_ += stopwatch.CoreSeconds();
}

}  // namespace luxfield::render
