// --memory of verbs that work through files of any size.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>

namespace luxfield::cli {

// Adds --memory, whose text goes to `memory`. `what` of the verb it bounds, a clause.
void AddMemoryOption(CLI::App& verb, std::string& memory, const std::string& what);

// What is left of it beside what the process takes already, bytes; absent where it was not given.
// Throws InputError for a text that is no number of bytes, and where nothing is left.
std::optional<std::uint64_t> MemoryLeft(const std::string& memory);

// Throws InputError naming `file` where `needed` bytes, for `what`, are more than are left.
void RequireMemory(const std::string& file, const std::string& what, std::uint64_t left,
                   std::uint64_t needed);

}  // namespace luxfield::cli
