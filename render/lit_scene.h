// A scene resident on a device: meshes with their hierarchy, light fields and the tables that
// estimators ask for. What is resident serves any number of pictures and estimators.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/core/colour.h"
#include "luxfield/environment/environment_sequence.h"
#include "luxfield/lightfield/light_field_file.h"
#include "luxfield/preprocess/intensity_table.h"
#include "luxfield/preprocess/kept_tables.h"
#include "luxfield/render/estimators/environment.h"
#include "luxfield/render/estimators/estimator.h"
#include "luxfield/render/estimators/mis.h"
#include "luxfield/render/lights/area_light.h"
#include "luxfield/render/lights/classical_light.h"
#include "luxfield/render/lights/environment_light.h"
#include "luxfield/render/lights/patch_shadows.h"
#include "luxfield/render/scene/device_scene.h"
#include "luxfield/scene/motion_path.h"
#include "luxfield/scene/scene.h"

namespace luxfield::render {

// A light field that one or several luminaires of the scene show, alone or with others of its file.
struct LoadedLightField {
  std::filesystem::path file, tables_file;  // tables_file empty: none given
  std::string sha256, part;     // of the file; and which of its fields this is, if it has names
  LuminaireOnDevice on_device;  // which alone holds the images
  std::vector<preprocess::ReferencePosition> reference;  // of the tables; empty until there are any
  std::optional<preprocess::IntensityTable> intensity;   // by RequireIntensities()
  double volume_error = 0;  // that its volume was made for; 0: it has none

  const lightfield::LuminaireGeometry& geometry() const { return on_device.geometry(); }
};

// A light of the scene, which owns what it refers to.
struct PlacedLight {
  LightSource source;
  core::Rgb scale = {1, 1, 1};  // of its channels
};

struct PlacedLuminaire {
  std::string name;
  std::shared_ptr<LoadedLightField> light_field;
  scene::Pose world_from_luminaire;
  core::Rgb scale = {1, 1, 1};         // of its channels
  std::size_t number = 0;              // of the scene's luminaires, whose field it is
  scene::Pose luminaire_from_field{};  // where the field stands in that
};

// The scene's environment map, or the frame shown of its sequence.
struct PlacedEnvironment {
  EnvironmentLight light;
  double scale = 1;
  std::optional<environment::EnvironmentSequence> sequence;  // none: a single map
  std::size_t frame = 0;                                     // of the sequence, from 0
};

// A field of a scene's luminaire of that number, as `light_field` has it loaded.
PlacedLuminaire PlaceField(const scene::Luminaire& luminaire, std::size_t number,
                           const lightfield::LightFieldFile::Field& field,
                           std::shared_ptr<LoadedLightField> light_field);

// What a field of a file is known by in the cache; `part` is its name.
preprocess::FieldOrigin OriginOf(const std::filesystem::path& file, const std::string& sha256,
                                 const std::string& part);

// Throws the InputError for a volume that would be too large.
[[noreturn]] void RefuseVolume(const std::filesystem::path& light_field);

class LitScene {
 public:
  // Along the longer side of the picture that a volume is made for.
  static constexpr int kVolumePixels = 512;

  // Reads the environment map, the light fields and the photometric files; a file that several
  // luminaires share is read and uploaded once, and each field of a light field's becomes a luminaire
  // ("NAME +z"). Throws InputError for files that cannot be read, luminaires of different units,
  // tables of a file of several fields and openings that are not of a model; DeviceError.
  LitScene(const Device& device, const scene::Scene& scene);
  // The same; the scene's triangles go as soon as the device has them.
  LitScene(const Device& device, scene::Scene&& scene);

  // Uploads what is needed and not there yet: a SAT is read where the scene names tables or
  // X.tab.exr lies beside the light field X.lf.exr, and built otherwise; tables of cells are
  // built; a light-vector volume is built over what the camera sees, for a relative RMSE of
  // `volume_error`, where there is none as good. Throws InputError for tables that cannot be read
  // or belong to another light field, and for light fields that tables cannot be built from (C that
  // is not finite).
  void Require(const TableNeeds& needs, double volume_error = 2e-3);

  // Has the soft shadow maps of every luminaire where it stands, of size^2 texels: those that are
  // there are drawn anew where the luminaire was moved. Throws what PatchShadows throws.
  void RequireSoftMaps(int size);
  // Of a luminaire, in their order; after RequireSoftMaps.
  const PatchShadows& soft_maps(std::size_t luminaire) const {
    return soft_maps_[luminaire].shadows;
  }

  // Makes the intensity tables of all luminaires. Throws InputError as Require().
  void RequireIntensities();

  // Makes the environment's tables as `options` ask for, if there is an environment.
  void RequireEnvironment(const EnvironmentTableOptions& options);

  // Pictures that the scene's environment makes of it: frames of a sequence, else 1.
  std::size_t frame_count() const;
  // Shows the next frame of the environment's sequence, which a thread read meanwhile, its tables
  // made anew; false after the last. Throws InputError as EnvironmentSequence::Next.
  bool NextFrame();
  // Shows that frame, of which there has to be one; those between are left out.
  void ShowFrame(std::size_t frame);

  // Another view of the scene, for pictures to come.
  void SetCamera(const scene::Camera& camera) { camera_ = camera; }

  // Lights pictures to come by these luminaires in place of its own, all of one unit, or by none.
  void ReplaceLuminaires(std::vector<PlacedLuminaire> luminaires);

  // Surface points that the camera sees in a picture of kVolumePixels at most, in the frame
  // of each of these luminaires: what volumes are made for.
  std::vector<preprocess::Receiver> SeenReceivers(
      std::span<const PlacedLuminaire> luminaires) const;

  // Stands luminaire `number` of the scene's elsewhere, with all its fields, and scales and colours its
  // light, for pictures to come. Volumes stay those of where it stood: what lies outside them is lit
  // by `exact`.
  void PlaceLuminaire(std::size_t number, const scene::PlacedLamp& lamp);

  // Stands the classical light of that number elsewhere, likewise.
  void PlaceClassicalLight(std::size_t number, const scene::PlacedLamp& lamp);

  // Turns the environment and scales its radiance, if there is one, for pictures to come.
  void PlaceEnvironment(const scene::Pose& world_from_environment, double scale);

  // Other materials, as many and of the same kinds, for pictures to come; the scene's textures.
  void SetMaterials(const std::vector<scene::Material>& materials,
                    const std::vector<scene::Texture>& textures) {
    ReplaceMaterials(materials, textures, geometry_);
  }

  // Forgets the volumes: the next picture that needs one builds it anew, as if it were the first.
  void DropVolumes();

  // The estimator of that name, made when first asked for: its kernels are then built once for all
  // pictures of the scene. InputError on unknown names.
  Estimator& EstimatorNamed(const std::string& name);

  const Device& device() const { return device_; }
  const scene::Camera& camera() const { return camera_; }
  // What lights with the area lights and the classical lights.
  MisEstimator& mis() { return mis_; }
  // What lights with the environment, made when first asked for.
  EnvironmentEstimator& environment_estimator();

  // What lights with one of Lights(): the near-field estimator of that name with a luminaire and the
  // environment's with an environment, but for area lights and classical lights, and for all with
  // `mis_everywhere`, mis().
  Estimator& EstimatorOf(const LightSource& source, const std::string& near_field,
                         bool mis_everywhere);

  const DeviceScene& geometry() const { return geometry_; }
  const std::vector<PlacedLuminaire>& luminaires() const { return luminaires_; }
  const std::vector<AreaLightSource>& area_lights() const { return area_lights_; }
  const std::vector<ClassicalLightSource>& classical_lights() const { return classical_lights_; }
  // Whether there are lights that mis() lights with whatever the near-field estimator is.
  bool has_strategies() const { return !area_lights_.empty() || !classical_lights_.empty(); }
  // All lights: luminaires, area lights, classical lights, environment.
  std::vector<PlacedLight> Lights() const;
  // Their names in scene.toml, in that order: a luminaire of several fields comes as often.
  const std::vector<std::string>& light_names() const { return light_names_; }
  // Null if the scene has none.
  const PlacedEnvironment* environment() const { return environment_ ? &*environment_ : nullptr; }
  lightfield::FluxUnit unit() const { return unit_.value_or(lightfield::FluxUnit::kRelative); }
  // SHA-256 of the scene's and the light fields' files.
  const lightfield::Provenance& provenance() const { return provenance_; }
  double tables_core_s() const { return tables_core_s_; }  // CPU time spent on building tables

 private:
  LitScene(const Device& device, const scene::Scene& scene, DeviceScene geometry);
  void LoadEnvironment(const scene::Environment& environment);
  void ShowEnvironment(const environment::CubeMap& map, const std::filesystem::path& file);
  struct LoadedField {
    lightfield::LightFieldFile::Field field;
    std::shared_ptr<LoadedLightField> light_field;
  };
  std::vector<LoadedField> Load(const scene::Luminaire& luminaire);
  void LoadClassicalLights(const std::vector<scene::ClassicalLight>& lights);
  void TakeUnit(lightfield::FluxUnit unit, const std::filesystem::path& file);
  preprocess::VolumeForError BuildVolume(const LoadedLightField& light_field,
                                         double max_rel_error) const;

  Device device_;
  scene::Camera camera_;
  struct PosedSoftMaps {
    scene::Pose world_from_luminaire;
    PatchShadows shadows;
  };

  DeviceScene geometry_;
  std::vector<PlacedLuminaire> luminaires_;
  std::vector<PosedSoftMaps> soft_maps_;  // of each luminaire, or empty
  std::vector<AreaLightSource> area_lights_;
  std::vector<ClassicalLightSource> classical_lights_;
  MisEstimator mis_;
  std::vector<std::string> light_names_;
  std::optional<PlacedEnvironment> environment_;
  std::optional<EnvironmentEstimator> environment_estimator_;
  std::optional<lightfield::FluxUnit> unit_;  // of the luminaires, if there are any
  lightfield::Provenance provenance_;
  std::map<std::string, std::unique_ptr<Estimator>> estimators_;
  double tables_core_s_ = 0;
};

}  // namespace luxfield::render
