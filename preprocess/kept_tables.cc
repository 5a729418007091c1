#include "luxfield/preprocess/kept_tables.h"

#include <fmt/format.h>

#include <optional>

#include "luxfield/core/file.h"
#include "luxfield/core/kept.h"

namespace luxfield::preprocess {
namespace {

std::optional<core::CacheKey> KeyOf(const char* kind, const char* what, const FieldOrigin& origin,
                                    const std::string& more = {}) {
  return core::KeyOfThisBuild(kind, fmt::format("{}\n{}\n{}", what, origin.sha256, more));
}

constexpr auto kTransferTables = [](auto& pass, auto& tables) {
  pass(tables.width, tables.height, tables.grid_width, tables.grid_height, tables.basis_cells,
       tables.sat, tables.exponent, tables.reference);
};

constexpr auto kTransferCells = [](auto& pass, auto& tables) {
  pass(tables.width, tables.height, tables.grid_width, tables.grid_height, tables.sat,
       tables.exponent);
};

constexpr auto kTransferVolume = [](auto& pass, auto& built) {
  auto& volume = built.volume;
  pass(volume.tau, volume.a_y, volume.a_x, volume.coefficients, built.judges, built.rel_error,
       built.met, built.wanted_bytes, built.builds);
};

}  // namespace

Tables KeptTables(const FieldSource& field, const FieldOrigin& origin) {
  Tables tables;
  tables.light_field_sha256 = origin.sha256;
  return core::Kept(KeyOf("table", "summed areas", origin), kTransferTables, tables,
                    [&] { return BuildTables(field(), origin.file, origin.sha256); });
}

CellTables KeptCellTables(const FieldSource& field, const FieldOrigin& origin) {
  return core::Kept(KeyOf("table", "cells", origin), kTransferCells, CellTables(),
                    [&] { return BuildCellTables(field(), origin.file); });
}

VolumeForError KeptVolume(const lightfield::FieldColumns& field, const FieldOrigin& origin,
                          std::span<const Receiver> receivers, const VolumeOptions& options) {
  static_assert(sizeof(Receiver) == 6 * sizeof(double));  // no padding in what is hashed
  const std::string seen =
      core::Sha256({reinterpret_cast<const char*>(receivers.data()), receivers.size_bytes()});
  VolumeForError start;
  start.volume.geometry = field.geometry();
  return core::Kept(
      KeyOf("volume", "light vectors", origin,
            fmt::format("{}\n{:a} {}", seen, options.max_rel_error, options.max_bytes)),
      kTransferVolume, start, [&] { return BuildForReceivers(field, receivers, options); },
      [](const VolumeForError& built) { return built.met; });
}

}  // namespace luxfield::preprocess
