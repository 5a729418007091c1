// The simulated lab: the devices a capture uses, and the truth it is judged by.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "luxfield/hal/devices.h"
#include "luxfield/hal/safety/stage_bounds.h"
#include "luxfield/lightfield/light_field.h"

namespace luxfield::hal::sim {

class World;

class SimulatedLab {
 public:
  // Throws InputError naming file and field. `seed` replaces the file's, and the stage keeps within
  // `plan` too.
  explicit SimulatedLab(const std::filesystem::path& lab_toml,
                        std::optional<std::uint64_t> seed = {}, const StageBounds& plan = {});
  explicit SimulatedLab(const core::Config& config, std::optional<std::uint64_t> seed = {},
                        const StageBounds& plan = {});

  // All devices belong to this lab's one world and clock; a capture takes them all. Opens the stage
  // where lab.toml names a real one (HardwareError); its moves then take real time.
  Devices MakeDevices() const;

  // The light field that an ideal measurement with this geometry has to give: a `lightfield` lamp
  // of the same geometry itself, any other lamp its least-squares projection onto the basis, texel
  // by texel (docs/theory.md 4), from inner products and a Gram matrix integrated numerically here.
  // delta must be the lab's (InputError). Texel means are over as many points as the sensor has
  // pixels there. Doubles, rounded once.
  lightfield::LightField truth(const lightfield::LuminaireGeometry& geometry) const;

  // E_ij on the lattice behind perfect prints of Phi_ij (scale 1):
  // [m][(channel * height + row) * width + column].
  std::vector<std::vector<float>> true_irradiance(
      const lightfield::LuminaireGeometry& geometry) const;

 private:
  std::shared_ptr<World> world_;
};

}  // namespace luxfield::hal::sim
