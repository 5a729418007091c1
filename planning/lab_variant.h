// A lab.toml with other error sources switched on, for studies that take the errors apart.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/lightfield/basis.h"

namespace luxfield::planning {

// Names of all [errors.*] tables of a lab file.
std::vector<std::string> ErrorSources(const std::filesystem::path& lab);

// errors.SOURCE.KEY of a lab file, put in place of what it says.
struct LabNumbers {
  std::string source, key;
  std::vector<double> values;  // one: a number, more: an array
};

// How each variant begins.
inline constexpr char kLabVariantMark[] = "# A variant of another lab, written by luxfield.";

// Writes `lab` to `variant` with only the named error sources enabled (those the file lacks are
// refused). `ideal` also switches quantisation and saturation off. The lamp's file, if it has one,
// keeps naming the same file.
void WriteLabVariant(const std::filesystem::path& lab, const std::vector<std::string>& enabled,
                     bool ideal, const std::filesystem::path& variant,
                     const std::vector<LabNumbers>& numbers = {});

// Writes `lab` to `variant` with another filter in its holder, and its light sampled about as
// finely per metre of F as before (sampling.u_per_cell). As above for the lamp's file.
struct LabFilter {
  bool dual = false;
  lightfield::Basis basis;
  double spacing_m = 0, scale = 1;
};
void WriteLabWithFilter(const std::filesystem::path& lab, const LabFilter& filter,
                        const std::filesystem::path& variant);

// errors.SOURCE.KEY as the lab file has it, whether enabled or not; absent: empty.
std::vector<double> ReadLabNumbers(const std::filesystem::path& lab, const std::string& source,
                                   const std::string& key);

}  // namespace luxfield::planning
