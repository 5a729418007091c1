// The arrays of doubles that NumPy saves (NPY format 1.0), for comparisons with its programs.
#pragma once

#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"

namespace luxfield::core {

// Values in file order; the shape is the caller's to know. Throws InputError where the file is
// another one.
inline std::vector<double> ReadNpy(const std::filesystem::path& path) {
  const std::string bytes = ReadFile(path);
  if (bytes.size() < 10 || bytes.compare(1, 5, "NUMPY") != 0 || bytes[6] != 1)
    throw InputError(path.string(), "is not an NPY 1.0 file", "save it with numpy.save");
  const std::size_t header =
      static_cast<unsigned char>(bytes[8]) + 256u * static_cast<unsigned char>(bytes[9]);
  if (bytes.size() < 10 + header)
    throw InputError(path.string(), "ends in its header", "save it with numpy.save");
  const std::string description = bytes.substr(10, header);
  if (description.find("'<f8'") == std::string::npos ||
      description.find("'fortran_order': False") == std::string::npos)
    throw InputError(path.string(), "does not hold doubles row by row",
                     "save a C-ordered array of float64");
  std::vector<double> values((bytes.size() - 10 - header) / sizeof(double));
  std::memcpy(values.data(), bytes.data() + 10 + header, values.size() * sizeof(double));
  return values;
}

}  // namespace luxfield::core
