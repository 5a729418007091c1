// The arrays of doubles that NumPy saves (NPY format 1.0), for comparisons with its programs.
#pragma once

#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/file.h"

namespace luxfield::reconstruct {

// Values in file order; the shape is the caller's to know.
inline std::vector<double> ReadNpy(const std::filesystem::path& path) {
  const std::string bytes = core::ReadFile(path);
  if (bytes.size() < 10 || bytes.compare(1, 5, "NUMPY") != 0 || bytes[6] != 1)
    throw std::runtime_error(path.string() + " is not an NPY 1.0 file");
  const std::size_t header =
      static_cast<unsigned char>(bytes[8]) + 256u * static_cast<unsigned char>(bytes[9]);
  const std::string description = bytes.substr(10, header);
  if (description.find("'<f8'") == std::string::npos ||
      description.find("'fortran_order': False") == std::string::npos)
    throw std::runtime_error(path.string() + " does not hold doubles row by row");
  std::vector<double> values((bytes.size() - 10 - header) / sizeof(double));
  std::memcpy(values.data(), bytes.data() + 10 + header, values.size() * sizeof(double));
  return values;
}

}  // namespace luxfield::reconstruct
