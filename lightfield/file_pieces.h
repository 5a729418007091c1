// Pieces of *.meas.exr and *.lf.exr: some positions of the one, some rows of both.
#pragma once

#include <filesystem>
#include <functional>

#include "luxfield/core/exr_spool.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/measurements.h"

namespace luxfield::lightfield {

// The positions first to last - 1 of WriteMeasurements(path, header, next) alone: a file of their
// parts. Those of all positions, one file's after the other's, are the parts of the whole. Packing
// is for measurements that are mostly 0; light packs slowly and by little.
void WriteMeasurementPositions(const std::filesystem::path& path, const Measurements& header,
                               int first, int last, const std::function<Measurement(int m)>& next,
                               core::ExrCompression compression = core::ExrCompression::kNone);

// The geometry alone.
LuminaireGeometry ReadMeasurementGeometry(const std::filesystem::path& path);

// Rows first to first + count - 1 of the images, as measurements on the lattice of these rows; others
// are not read. Throws InputError as ReadMeasurements, and where the file has no such rows.
Measurements ReadMeasurementRows(const std::filesystem::path& path, int first, int count);

// Some rows of a light field of geometry `whole`: `rows` has these rows as its lattice. A file whose
// attributes are the whole's and whose images have these rows alone; images of files of all rows, one
// below the other, are those of the whole. It is no light field that ReadLightField takes.
void WriteLightFieldRows(const std::filesystem::path& path, const LuminaireGeometry& whole,
                         const LightField& rows);

// A light field whose rows come in bands, from the top, a multiple of core::ExrRowSpool::kRows of
// them where they are not the last. The file is, to the byte, that of WriteLightField of all rows;
// until it is written, bands wait packed in scratch beside it that has no name.
class LightFieldBands {
 public:
  // `provenance` of the whole. Throws as WriteLightField.
  LightFieldBands(const std::filesystem::path& path, const LuminaireGeometry& whole,
                  const Provenance& provenance);
  // Of `rows`, on the lattice of these rows; `later`, per texel, empty for none: those whose values
  // Write puts in.
  void Add(LightField rows, const std::vector<bool>& later = {});
  // Writes the file; value(channel) is that of texels that were left for later.
  void Write(const std::function<float(int channel)>& value = {});

 private:
  std::filesystem::path path_;
  int channels_ = 1;
  core::ExrRowSpool spool_;
};

}  // namespace luxfield::lightfield
