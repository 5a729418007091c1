#include "luxfield/preprocess/table_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"
#include "luxfield/lightfield/light_field_file.h"
#include "luxfield/preprocess/summed_area.h"

namespace luxfield::preprocess {
namespace {

using lightfield::LightFieldFile;
using lightfield::LuminaireGeometry;

// Images of a file's only field, some of them read at once and worked on side by side.
class ImageQueue {
 public:
  ImageQueue(const TableSource& source)
      : source_(source), file_(source.light_field), planes_(source.images_at_once) {
    for (auto& planes : planes_) planes.resize(geometry().plane_size() * geometry().channels);
  }

  const LuminaireGeometry& geometry() const { return file_.only().geometry; }

  // Calls work(slot, m, planes) for images from `first` on, at most images_at_once and those below
  // `last`; how many these are.
  int Take(
      int first, int last,
      const std::function<void(std::size_t slot, int m, std::span<const float> planes)>& work) {
    core::ThrowIfInterrupted();
    const int count = std::min(source_.images_at_once, last - first);
    for (int k = 0; k < count; ++k) file_.ReadImage(0, first + k, planes_[k]);
    core::ParallelFor(static_cast<std::size_t>(count), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) work(k, first + static_cast<int>(k), planes_[k]);
    });
    return count;
  }

 private:
  const TableSource& source_;
  LightFieldFile file_;
  std::vector<std::vector<float>> planes_;
};

// With the exponents of images first to last - 1, which a file states before it holds the images.
Tables Shape(const TableSource& source, ImageQueue& images, int first, int last) {
  Tables tables = TablesWithoutImages(images.geometry(), source.sha256);
  std::vector<std::vector<float>> magnitudes(source.images_at_once,
                                             std::vector<float>(images.geometry().plane_size()));
  for (int m = first; m < last;)
    m += images.Take(m, last, [&](std::size_t slot, int image, std::span<const float> planes) {
      tables.exponent[image] = SummedAreaExponent(
          MagnitudeSum(images.geometry(), planes, source.name, image, magnitudes[slot]));
    });
  return tables;
}

std::vector<MedianPoint> Write(const TableSource& source, const std::filesystem::path& output,
                               int first, int last, bool with_reference) {
  ImageQueue images(source);
  const LuminaireGeometry& geometry = images.geometry();
  const Tables shape = Shape(source, images, first, last);
  const auto slots = static_cast<std::size_t>(source.images_at_once);
  std::vector<std::vector<float>> magnitudes(slots, std::vector<float>(geometry.plane_size()));
  std::vector<std::vector<std::uint64_t>> sats(slots, std::vector<std::uint64_t>(shape.sat_size()));
  std::vector<MedianPoint> points(static_cast<std::size_t>(last - first));
  core::Progress progress("tables", points.size());
  int begin = first, end = first;  // of the images in `sats`
  const auto next = [&](int m) -> std::span<const std::uint64_t> {
    if (m >= end) {
      begin = m;
      end =
          m + images.Take(m, last, [&](std::size_t slot, int image, std::span<const float> planes) {
            const double sum = MagnitudeSum(geometry, planes, source.name, image, magnitudes[slot]);
            BuildSummedArea(std::span<const float>(magnitudes[slot]), sum, shape.width,
                            shape.height, sats[slot].data());
            points[image - first] = FindMedianPoint(sats[slot].data(), geometry.lattice);
          });
      progress.Advance(static_cast<std::uint64_t>(end - begin));
    }
    return sats[m - begin];
  };
  WriteTableParts(output, shape, first, last, next,
                  with_reference ? [&] { return ReferencePositions(shape, points); }
                                 : std::function<std::vector<ReferencePosition>()>());
  return points;
}

// What OpenEXR 3.1 holds of the parts of both files until these are closed: headers, tables of
// offsets, and for each part written two lines a thread. Measured, a part of 65 x 65 takes 37 KiB,
// one of 2049 x 2049 on two threads 168 KiB.
std::uint64_t PartBytes(const LuminaireGeometry& geometry) {
  constexpr std::uint64_t kHeaders = 48 << 10, kLine = 8, kOfRow = 40;
  const auto columns = static_cast<std::uint64_t>(geometry.lattice.width) + 1,
             rows = static_cast<std::uint64_t>(geometry.lattice.height) + 1,
             lines = 2 * static_cast<std::uint64_t>(core::Threads());
  return static_cast<std::uint64_t>(geometry.grid.count()) *
         (kHeaders + lines * kLine * columns + kOfRow * rows);
}

}  // namespace

std::uint64_t TableBytes(const LuminaireGeometry& geometry, int images) {
  constexpr std::uint64_t kBeside = std::uint64_t{16} << 20;
  const std::uint64_t texels = geometry.plane_size(),
                      of_image = 4 * static_cast<std::uint64_t>(geometry.channels) + 8 + 8;
  return texels * (of_image * static_cast<std::uint64_t>(images) + 8) + PartBytes(geometry) +
         kBeside;
}

int TableImagesWithin(const LuminaireGeometry& geometry, const std::string& name,
                      std::uint64_t bytes, int most) {
  int images = 0;
  while (images < most && TableBytes(geometry, images + 1) <= bytes) ++images;
  if (images == 0)
    throw InputError(
        name,
        fmt::format("one image of {} x {} texels and its table do not fit into {} MiB",
                    geometry.lattice.width, geometry.lattice.height, bytes >> 20),
        fmt::format("give it {} MiB more", ((TableBytes(geometry, 1) - bytes) >> 20) + 1));
  return images;
}

std::vector<MedianPoint> WriteTableImages(const TableSource& source,
                                          const std::filesystem::path& output, int first,
                                          int last) {
  return Write(source, output, first, last, false);
}

TableReferencePart TableReferenceOf(const TableSource& source,
                                    const std::vector<MedianPoint>& points) {
  const LightFieldFile file(source.light_field);
  const Tables shape = TablesWithoutImages(file.only().geometry, source.sha256);
  return {shape, ReferencePositions(shape, points)};
}

std::vector<MedianPoint> WriteTablesOf(const TableSource& source,
                                       const std::filesystem::path& output) {
  const LightFieldFile file(source.light_field);
  return Write(source, output, 0, file.only().geometry.grid.count(), true);
}

}  // namespace luxfield::preprocess
