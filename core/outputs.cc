#include "luxfield/core/outputs.h"

#include <algorithm>
#include <string>
#include <utility>

#include "luxfield/core/descriptor.h"
#include "luxfield/core/file_kind.h"

namespace luxfield::core {
namespace {

namespace fs = std::filesystem;

Outputs* g_outputs = nullptr;

}  // namespace

Outputs::Outputs() { g_outputs = this; }
Outputs::~Outputs() { g_outputs = nullptr; }

WritesAtOnce::WritesAtOnce() : waiting_(std::exchange(g_outputs, nullptr)) {}
WritesAtOnce::~WritesAtOnce() { g_outputs = waiting_; }

void Outputs::PutInPlace() {
  for (const StagedFile& file : waiting_) file.Sync();
  std::size_t renamed = 0;
  try {
    for (; renamed < waiting_.size(); ++renamed) waiting_[renamed].Exchange();
    std::set<fs::path> folders;
    for (const StagedFile& file : waiting_) folders.insert(FolderOf(file.path()));
    for (const fs::path& folder : folders) SyncFolder(folder);
  } catch (...) {
    while (renamed > 0) waiting_[--renamed].Undo();
    throw;
  }
  waiting_.clear();
  StorageStep("outputs in place");
}

void PutOutputsInPlace() {
  if (g_outputs) g_outputs->PutInPlace();
}

void Place(StagedFile file) {
  if (!g_outputs) return file.PutInPlace();
  if (ReadableAt(file.path()) != file.path())
    throw InputError(file.path().string(), "two outputs have this name", "name them apart");
  const fs::path folder = FolderOf(file.path());
  g_outputs->waiting_.push_back(std::move(file));
  if (g_outputs->swept_.insert(folder).second) SweepTemporaries(folder);
}

fs::path ReadableAt(const fs::path& path) {
  if (g_outputs)
    for (const StagedFile& file : g_outputs->waiting_)
      if (file.path().lexically_normal() == path.lexically_normal()) return file.temporary();
  return path;
}

bool WriteCacheFile(const fs::path& path, std::string_view bytes) {
  std::error_code ignored;
  fs::create_directories(path.parent_path(), ignored);
  try {
    StagedFile(path, std::span(&bytes, 1), Access::kUmask).PutInPlace();
    return true;
  } catch (const Error&) {
    return false;
  }
}

void RequireOwn(const fs::path& path, const fs::path& output, std::string_view mark) {
  RequireReplaceable(path);
  std::error_code unknown;
  if (!fs::exists(path, unknown)) return;
  bool found = false;
  std::string text;  // from where the mark may begin
  ReadInPieces(path, [&](std::string_view piece) {
    text += piece;
    found = found || text.find(mark) != text.npos;
    text.erase(0, text.size() - std::min(text.size(), mark.size() - 1));
  });
  if (!found)
    throw InputError(path.string(),
                     fmt::format("is {}, in whose place a file that belongs to {} would come",
                                 NameOf(WhatIs(path)), output.filename().string()),
                     "move it away, or name another output");
}

void RequireOutputPlace(const fs::path& path) {
  const fs::path folder = FolderOf(path);
  std::error_code unknown;
  const auto above = fs::status(folder, unknown);
  if (!fs::exists(above))
    throw InputError(path.string(), fmt::format("there is no folder '{}'", folder.string()),
                     "make it, or name another");
  if (!fs::is_directory(above))
    throw InputError(path.string(), fmt::format("'{}' is no folder", folder.string()),
                     "name one that is");
  RequireReplaceable(path);
  if (::access(folder.c_str(), W_OK | X_OK) != 0) FailWriting(path, "create");
}

}  // namespace luxfield::core
