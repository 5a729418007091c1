// The light fields of a *.lf.exr with their images read one after the other, for who keeps them
// elsewhere: a field that fills the memory is held there once.
//
//   LightFieldFile file("lamp.lf.exr");
//   for (int m = 0; m < file.fields()[0].geometry.grid.count(); ++m) file.ReadImage(0, m, planes);
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "luxfield/lightfield/posed_light_field.h"

namespace luxfield::lightfield {

class LightFieldFile {
 public:
  // Reads and checks everything but the images. Throws InputError as ReadLightFields.
  explicit LightFieldFile(const std::filesystem::path& path);
  ~LightFieldFile();
  LightFieldFile(LightFieldFile&&) noexcept;

  struct Field {
    std::string name;  // empty: the file's only one, at the identity
    RigidPose luminaire_from_field;
    LuminaireGeometry geometry;
    Provenance provenance;
  };
  const std::vector<Field>& fields() const;
  // The only field of a file that holds one in one direction. Throws InputError for others.
  const Field& only() const;

  // Image m of all channels, [channel][row][column], of a file that may have changed meanwhile.
  // Throws InputError where it is damaged, or a value is not finite.
  void ReadImage(std::size_t field, int m, std::span<float> planes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace luxfield::lightfield
