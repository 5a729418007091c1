// A lab.toml with other error sources switched on, for studies that take the errors apart.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace luxfield::study {

// Names of all [errors.*] tables of a lab file.
std::vector<std::string> ErrorSources(const std::filesystem::path& lab);

// Writes `lab` to `variant` with only the named error sources enabled (those the file lacks are
// refused). `ideal` also switches quantisation and saturation off. The lamp's file, if it has one,
// keeps naming the same file.
void WriteLabVariant(const std::filesystem::path& lab, const std::vector<std::string>& enabled,
                     bool ideal, const std::filesystem::path& variant);

}  // namespace luxfield::study
