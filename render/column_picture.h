// A picture lit by light fields of any size. Light adds up, so that the picture is the sum of those
// that groups of columns of basis functions make (lightfield/field_columns.h),
//
//   L(pixel) = sum over luminaires and groups g of L_g(pixel)
//
// of which one is in memory at a time. `volume` has the light of all of them in its table, and the
// groups light what the table leaves to `exact`.
//
//   ColumnPicture picture(device, std::move(scene), options);
//   const Frame frame = picture.Render(std::uint64_t{512} << 20);
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "luxfield/lightfield/field_columns.h"
#include "luxfield/render/renderer.h"

namespace luxfield::render {

class ColumnPicture {
 public:
  // Has the scene on the device, without its luminaires, and the kernels built. Throws InputError
  // for what takes whole light fields, by name: estimators other than `exact` and `volume`, shadows
  // other than none and, of `exact`, maps; for lights that are no light fields; DeviceError.
  // Groups have `most_columns` at most, whatever memory there is.
  ColumnPicture(const Device& device, scene::Scene scene, const RenderOptions& options,
                int most_columns = std::numeric_limits<int>::max());

  // The picture of Renderer: `exact` in another order of sums, `volume` from the same table. Takes
  // at most `bytes` more of memory than the process takes already. Throws InputError, with what
  // would do, where the picture and one column, or the table for the error asked for, do not fit
  // into that; what LitScene and Renderer throw.
  Frame Render(std::uint64_t bytes);

 private:
  // A field of a file, and where it stands.
  struct Field {
    std::filesystem::path path;
    std::string sha256;
    std::shared_ptr<lightfield::LightFieldFile> file;
    std::size_t number = 0;                   // in the file
    std::vector<PlacedLuminaire> luminaires;  // that show it; without light fields

    const lightfield::LightFieldFile::Field& field() const { return file->fields()[number]; }
    const lightfield::LuminaireGeometry& geometry() const { return field().geometry; }
  };
  // The volume of a field, and what lights its judges.
  struct Table {
    preprocess::VolumeForError made;
    std::vector<cl_float4> lit;  // irradiance by the groups so far

    void Add(std::span<const cl_float4> more);
  };

  void LoadHeaders(const std::vector<scene::Luminaire>& luminaires);
  // Builds the kernels, so that what the compiler takes is no part of what is left.
  void Warm();
  bool by_volume() const { return options_.estimator == "volume"; }
  std::uint64_t PictureBytes() const;
  // Of so many columns while they light.
  std::uint64_t GroupBytes(const Field& field, int columns) const;
  // As many columns as fit. Throws InputError where none does.
  int ColumnsWithin(const Field& field, std::uint64_t bytes) const;
  Table MakeTable(const Field& field, std::uint64_t bytes);
  void AddField(const Field& field, std::uint64_t bytes, Frame& sum);
  void AddGroup(const Field& field, const lightfield::ColumnGroup& group, Table& table, Frame& sum);

  Device device_;
  RenderOptions options_;
  int most_columns_;
  std::vector<Field> fields_;
  lightfield::Provenance provenance_;  // of the luminaires
  LitScene lit_;                       // without luminaires but while a group is shown
};

}  // namespace luxfield::render
