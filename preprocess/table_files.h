// *.lf.exr to *.tab.exr, some images at a time: the bytes of WriteTables of BuildTables.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/preprocess/table_images.h"
#include "luxfield/preprocess/table_parts.h"

namespace luxfield::preprocess {

// A light field in a file, and how much of it is in memory.
struct TableSource {
  std::filesystem::path light_field;
  std::string name;    // for messages
  std::string sha256;  // of the file
  int images_at_once = 1;
};

// Bytes that so many images and their tables take at once.
std::uint64_t TableBytes(const lightfield::LuminaireGeometry& geometry, int images);

// How many images at once fit into so many bytes, at most `most`. Throws InputError, naming `name`
// and the bytes that are needed, where one does not.
int TableImagesWithin(const lightfield::LuminaireGeometry& geometry, const std::string& name,
                      std::uint64_t bytes, int most);

// The tables of images first to last - 1 as a file of their parts; their median points. Throws
// InputError as BuildTables, DeviceError.
std::vector<MedianPoint> WriteTableImages(const TableSource& source,
                                          const std::filesystem::path& output, int first, int last);
// The part behind those of the images, from the points of all.
TableReferencePart TableReferenceOf(const TableSource& source,
                                    const std::vector<MedianPoint>& points);

// All of it; the median points.
std::vector<MedianPoint> WriteTablesOf(const TableSource& source,
                                       const std::filesystem::path& output);

}  // namespace luxfield::preprocess
